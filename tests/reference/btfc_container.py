"""The container part of the reference reader: spec/btfc.md, sections 2 to 6, and the numbers of spec/registry.md.

A File reads the header and the index, then HEAD and PARM, and is complete when rule D12 holds. Everything else is
read on request, one chunk at a time, so that memory stays within the limit of one chunk plus the index.
"""

import math
import struct
from dataclasses import dataclass

import xxhash
import zstandard

MAGIC = bytes.fromhex("AB 42 54 46 43 20 31 BB 0D 0A 1A 0A")
CRITICAL, PAYLOAD, SAFE_TO_COPY = 1, 2, 4
MAX_CHUNKS, MAX_RAW, MAX_SIZE, MAX_PAIRS = 1 << 20, 1 << 27, 65536, 1 << 20
MAX_HEAD, MAX_PARM, MAX_META, MAX_QUALITY, MAX_WINDOW = 544, 4096, 1 << 20, 16 + 40 * 1024, 1 << 23

SAMPLE_TYPES = ("unorm8", "unorm16", "float16")
SAMPLE_BITS = (8, 16, 16)
COLOUR_SPACES = ("unknown", "srgb_rec709_scene", "lin_rec709_scene", "lin_ap0_scene", "lin_ap1_scene",
                 "lin_ciexyzd65_scene", "data")
QUANTITY_COUNT, TRANSFORM_COUNT, ALPHA_COUNT = 5, 3, 3
NAME_BYTES = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-")
KEY_BYTES = NAME_BYTES | frozenset(b".:")
MAX_ENTRIES = 65536  # of a list in DOMN
ANCILLARY = {b"META": SAFE_TO_COPY, b"DOMN": 0, b"QUAL": 0}  # in any model's file, at most once


class Refusal(Exception):
    """A file that breaks a rule (kind "invalid") or needs a reader that knows more (kind "unsupported")."""

    def __init__(self, rule, message, kind="invalid"):
        super().__init__(message)
        self.rule, self.message, self.kind = rule, message, kind


def require(condition, rule, message, kind="invalid"):
    if not condition:
        raise Refusal(rule, message, kind)


def ceil_div(n, d):
    return -(-n // d)


def align(n, a):
    return ceil_div(n, a) * a


def ceil_log2(n):
    """The smallest b >= 0 with 2^b >= n. Zero for n = 0, which occurs only where no cut exists."""
    return max(n - 1, 0).bit_length()


@dataclass(frozen=True)
class Entry:
    type: bytes
    flags: int
    codec: int
    offset: int
    stored_bytes: int
    raw_bytes: int
    raw_hash: int
    key_a: int
    tile: int

    item = property(lambda e: e.key_a >> 16)
    level = property(lambda e: e.key_a >> 8 & 255)
    part = property(lambda e: e.key_a & 255)

    def order(self):
        rank = 2 if not self.flags & CRITICAL else 1 if self.flags & PAYLOAD else 0
        return rank, self.item, self.level, self.type, self.part, self.tile

    key = property(lambda e: (e.type, e.part, e.level, e.tile))

    def name(self):
        return chunk_name(*self.key)


@dataclass(frozen=True)
class Demand:
    """A critical chunk that a model asks for."""
    type: bytes
    raw_bytes: int
    level: int = 0
    part: int = 0
    tile: int = 0
    flags: int = CRITICAL | PAYLOAD

    key = property(lambda d: (d.type, d.part, d.level, d.tile))

    def name(self):
        return chunk_name(*self.key)


def chunk_name(kind, part, level, tile):
    numbers = [f"{what} {number}" for what, number in (("level", level), ("tile", tile)) if number]
    return f"{kind.decode('latin-1')} ({', '.join([f'part {part}'] + numbers)})"


@dataclass(frozen=True)
class Map:
    name: str
    channels: int
    sample_type: int
    colour_space: int
    alpha: int

    bits = property(lambda m: SAMPLE_BITS[m.sample_type])


@dataclass(frozen=True)
class Head:
    model: int
    width: int
    height: int
    views: int
    lights: int
    pairs: int
    channels: int
    wrap_u: int
    wrap_v: int
    unbounded: int
    transform: int
    maps: tuple


def parse_head(raw, models):
    # The size can be compared with map_count only where the fixed part is complete.
    require(len(raw) >= 32 and len(raw) == 32 + 32 * raw[24], "H1", f"HEAD has {len(raw)} bytes")
    (model, width, height, views, lights, pairs, map_count, channels, wrap_u, wrap_v, unbounded, quantity, transform,
     reserved) = struct.unpack_from("<6I8B", raw)
    rows = [struct.unpack_from("<24s4BI", raw, 32 + 32 * i) for i in range(map_count)]
    require(model in models, "H2", f"model {model} is not known", "unsupported")

    ranges = [("width", width, MAX_SIZE), ("height", height, MAX_SIZE), ("view_count", views, 1 << 16),
              ("light_count", lights, 1 << 16), ("pair_count", pairs, MAX_PAIRS), ("map_count", map_count, 16),
              ("channel_count", channels, 16)]
    ranges += [(f"channel_count of map {i}", row[1], 4) for i, row in enumerate(rows)]
    for what, value, most in ranges:
        require(1 <= value <= most, "H3", f"{what} is {value}")
    require(channels == sum(row[1] for row in rows), "H4", f"channel_count {channels} is not the sum over the maps")

    listed = [("wrap_u", wrap_u, 2), ("wrap_v", wrap_v, 2), ("unbounded", unbounded, 2),
              ("quantity", quantity, QUANTITY_COUNT), ("value_transform", transform, TRANSFORM_COUNT),
              ("reserved", reserved, 1)]
    for i, (_, _, sample_type, colour_space, alpha, map_reserved) in enumerate(rows):
        listed += [(f"sample_type of map {i}", sample_type, len(SAMPLE_TYPES)),
                   (f"colour_space of map {i}", colour_space, len(COLOUR_SPACES)),
                   (f"alpha of map {i}", alpha, ALPHA_COUNT), (f"reserved of map {i}", map_reserved, 1)]
    for what, value, count in listed:
        require(value < count, "H5", f"{what} is {value}")

    names = []
    for i, row in enumerate(rows):
        name = row[0].rstrip(b"\0")
        require(name and NAME_BYTES.issuperset(name), "H6", f"the name of map {i} is not well formed")
        require(name not in names, "H6", f"the name of map {i} occurs twice")
        names.append(name)
    for i, row in enumerate(rows):
        require(row[4] == 0 or row[1] > 1, "H7", f"map {i} has one channel and alpha {row[4]}")
    maps = tuple(Map(name.decode(), *row[1:5]) for name, row in zip(names, rows))
    return Head(model, width, height, views, lights, pairs, channels, wrap_u, wrap_v, unbounded,
                transform, maps)


def check_frame(stored, raw_bytes):
    """Rule C1: the frame and block headers of RFC 8878, without decompressing anything."""
    def need(condition, message):
        require(condition, "C1", message)

    need(len(stored) >= 5 and stored[:4] == b"\x28\xB5\x2F\xFD", "no zstd frame")
    descriptor = stored[4]
    single = descriptor >> 5 & 1
    need(not descriptor & 8, "reserved bit of the frame header set")
    need(not descriptor & 4, "content checksum present")
    need(not descriptor & 3, "dictionary id present")
    size_bytes = (1 if single else 0, 2, 4, 8)[descriptor >> 6]
    need(size_bytes, "no Frame_Content_Size")
    at = 5 if single else 6
    need(len(stored) >= at + size_bytes, "frame header cut short")
    content = int.from_bytes(stored[at:at + size_bytes], "little") + (256 if size_bytes == 2 else 0)
    need(content == raw_bytes, f"Frame_Content_Size {content} is not raw_bytes {raw_bytes}")
    if not single:
        base = 1 << 10 + (stored[5] >> 3)
        need(base + base // 8 * (stored[5] & 7) <= MAX_WINDOW, "Window_Size above 2^23")
    at += size_bytes
    last = False
    while not last:
        need(len(stored) >= at + 3, "frame cut short")
        block = int.from_bytes(stored[at:at + 3], "little")
        last, kind, size = block & 1, block >> 1 & 3, block >> 3
        need(kind != 3, "reserved block type")
        at += 3 + (1 if kind == 1 else size)
        need(at <= len(stored), "block cut short")
    need(at == len(stored), "bytes after the frame")


def check_quality(raw, pairs):
    """Rules QU1 and QU2."""
    def need(condition, message):
        require(condition, "QU1", "QUAL: " + message)

    need(16 + 40 <= len(raw) <= MAX_QUALITY, f"{len(raw)} bytes")
    count, measures, measured, reserved = struct.unpack_from("<4I", raw)
    need(len(raw) == 16 + 40 * count, f"{count} points in {len(raw)} bytes")
    need(1 <= measures <= 31, f"measures {measures}")
    need(1 <= measured <= pairs, f"{measured} pairs of {pairs}")
    need(reserved == 0, "reserved is not 0")
    seen = set()
    for at in range(16, len(raw), 40):
        levels, gates, culling, *values, operations, reads, reserved = struct.unpack_from("<2I5f3I", raw, at)

        def need_here(condition, message):
            require(condition, "QU2", f"QUAL: the point at {at}: {message}")

        need_here(levels <= 256 and gates <= 32 and 0 <= culling <= 1, "knobs out of range")
        for bit, (value, most) in enumerate(zip(values, (200, 1e30, 1e30, 1e30))):
            need_here(0 <= value <= most, f"measure {bit} is {value}")
            need_here(measures >> bit & 1 or value == 0, f"measure {bit} is not among the measures")
        need_here(measures & 16 or operations == reads == 0, "a cost that is not among the measures")
        need_here(reserved == 0, "reserved is not 0")
        need_here((levels, gates, culling) not in seen, "the knobs of a point before it")
        seen.add((levels, gates, culling))


def check_meta(raw):
    """Rule M1."""
    def need(condition, message):
        require(condition, "M1", "META: " + message)

    need(len(raw) <= MAX_META, "longer than 1 MiB")
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        need(False, "not UTF-8")
    need(raw.endswith(b"\n"), "last line not ended")
    previous = b""
    for number, line in enumerate(raw[:-1].split(b"\n"), 1):
        key, equals, value = line.partition(b"=")
        need(equals and 1 <= len(key) <= 64 and KEY_BYTES.issuperset(key), f"line {number} has no well formed key")
        need(not value or min(value) >= 0x20, f"line {number} holds a control byte")
        need(key > previous, f"the key of line {number} is not above the one before")
        previous = key


def check_domain(head, raw):
    """Rules DM1 to DM5."""
    fields = struct.unpack_from("<4B2f2I2f2I8f", raw) if len(raw) >= 68 else None
    entries = fields[10:12] if fields else (0, 0)
    require(fields and max(entries) <= MAX_ENTRIES and len(raw) == 68 + 8 * sum(entries), "DM1",
            f"DOMN has {len(raw)} bytes and entries {entries}")
    kinds, scale, reserved = fields[:2], fields[2], fields[3]
    tolerance, radius, x, y, least, most = fields[4:10]
    ranges = fields[12:16], fields[16:20]
    require(max(kinds) <= 3 and scale <= 16 and reserved == 0, "DM2", f"DOMN: kinds {kinds}, scale {scale}")
    require(3 not in kinds or kinds == (3, 3) and entries[0] == entries[1], "DM2", "DOMN: pairs on one side alone")
    for kind, count, extent in zip(kinds, entries, ranges):
        require((kind >= 2) == (count > 0), "DM2", f"DOMN: {count} entries of kind {kind}")
        require(kind == 1 or all(v == 0 for v in extent), "DM2", f"DOMN: a range of kind {kind}")
    quarter, whole, largest = (struct.unpack("<f", struct.pack("<f", v))[0]
                               for v in (math.pi / 2, 2 * math.pi, 3.4028234663852886e38))
    require(0 <= tolerance <= quarter and 0 <= radius <= quarter, "DM3", "DOMN: tolerance or radius")
    require(0 <= least <= most <= largest, "DM3", f"DOMN: footprints {least} to {most}")
    for low, high, begin, width in ranges:
        require(0 <= low <= high <= quarter and 0 <= begin <= whole and 0 <= width <= whole, "DM3", "DOMN: a range")
    for X, Y in struct.iter_unpack("<2i", raw[68:]):
        require(X * X + Y * Y <= 1 << 48, "DM4", f"DOMN: the point ({X}, {Y})")
    require(x + (head.width << scale) <= 1 << 32 and y + (head.height << scale) <= 1 << 32, "DM5",
            "DOMN: the texture ends beyond 2^32")


class File:
    """An opened file. `models` maps model numbers to classes (see btfc_patch.Model for what one provides)."""

    def __init__(self, stream, models):
        self.stream = stream
        self.size = stream.seek(0, 2)
        self._read_directory()
        self._read_description(models)

    def _read(self, offset, count):
        self.stream.seek(offset)
        data = self.stream.read(count)
        if len(data) != count:
            raise OSError("the file became shorter while it was read")
        return data

    def _read_directory(self):
        require(self.size >= 64, "F1", f"{self.size} bytes, shorter than a header")
        header = self._read(0, 64)
        (magic, major, minor, incompatible, _, count, align_log2, self.file_bytes, self.payload_bytes, reserved,
         directory_hash) = struct.unpack("<12sHH4I4Q", header)
        require(magic == MAGIC, "F2", "not a btfc file")
        require((major, minor) == (0, 1), "F3", f"format version {major}.{minor}", "unsupported")
        require(incompatible == 0, "F4", f"incompatible_features is {incompatible:#x}", "unsupported")
        require(1 <= count <= MAX_CHUNKS and 64 + 48 * count <= self.size, "F5", f"chunk_count is {count}")
        require(4 <= align_log2 <= 16, "F6", f"align_log2 is {align_log2}")
        require(self.file_bytes == self.size, "F7", f"file_bytes is {self.file_bytes}, the size {self.size}")
        require(reserved == 0, "F8", "reserved is not 0")
        index = self._read(64, 48 * count)
        require(xxhash.xxh3_64_intdigest(header[:56] + index) == directory_hash, "F9", "directory_hash is wrong")
        self.version, self.alignment = f"{major}.{minor}", 1 << align_log2
        self.entries = [Entry(*fields) for fields in struct.iter_unpack("<4sHHQQQQII", index)]

        def each(rule, condition, message):
            for i, e in enumerate(self.entries):
                require(condition(e), rule, f"entry {i}, {e.name()}: {message}")

        each("D1", lambda e: e.flags < 8 and (e.flags & CRITICAL or not e.flags & PAYLOAD), "flags")
        each("D2", lambda e: all(0x21 <= c <= 0x7E for c in e.type), "type characters")
        each("D3", lambda e: e.codec <= 1, "codec")
        each("D4", lambda e: 1 <= e.raw_bytes <= MAX_RAW, "raw_bytes")
        each("D5", lambda e: 1 <= e.stored_bytes < e.raw_bytes if e.codec else e.stored_bytes == e.raw_bytes,
             "stored_bytes")
        for before, after in zip(self.entries, self.entries[1:]):
            require(before.order() < after.order(), "D6", f"{after.name()} stands after {before.name()}")
        each("D7", lambda e: e.item == 0, "item")
        offsets, end = self.layout([e.stored_bytes for e in self.entries])
        for e, offset in zip(self.entries, offsets):
            require(e.offset == offset, "D8", f"{e.name()} has offset {e.offset} instead of {offset}")
        require(self.file_bytes == end, "D9", f"file_bytes is {self.file_bytes}, the last chunk ends at {end}")
        payload = sum(e.raw_bytes for e in self.entries if e.flags & PAYLOAD)
        require(self.payload_bytes == payload, "D10", f"payload_bytes is {self.payload_bytes} instead of {payload}")

    def layout(self, sizes):
        """Section 2: the offsets of chunks of these sizes, and the end of the file."""
        offsets, end = [], 64 + 48 * len(sizes)
        for size in sizes:
            offsets.append(align(end, self.alignment))
            end = offsets[-1] + size
        return offsets, end

    def _read_description(self, models):
        def found(kind, flags):
            return next((e for e in self.entries if e.key == (kind, 0, 0, 0) and e.flags == flags), None)

        head = found(b"HEAD", CRITICAL)
        require(head, "D12", "HEAD is missing")
        require(head.raw_bytes <= MAX_HEAD, "D12", f"HEAD has {head.raw_bytes} bytes")
        self.head = parse_head(self.raw(head), models)
        model = models[self.head.model]
        parm = found(b"PARM", CRITICAL | PAYLOAD)
        require(parm, "D12", "PARM is missing")
        require(parm.raw_bytes <= MAX_PARM, "D12", f"PARM has {parm.raw_bytes} bytes")
        self.model = model(self.head, self.raw(parm))
        known = {b"HEAD", b"PARM", *ANCILLARY} | model.TYPES
        for e in self.entries:
            require(not e.flags & CRITICAL or e.type in known, "D11", f"unknown critical chunk {e.name()}",
                    "unsupported")

        # DIRS and HEAD are critical without being payload, all others that a model demands are both.
        head_demand = Demand(b"HEAD", 32 + 32 * len(self.head.maps), flags=CRITICAL)
        wanted = {d.key: d for d in [head_demand] + self.model.demands()}
        self.described = {}
        for e in self.entries:
            if e.type not in known:
                continue
            demand = wanted.get(e.key)
            if e.type in ANCILLARY and e.key == (e.type, 0, 0, 0):
                demand = Demand(e.type, e.raw_bytes, flags=ANCILLARY[e.type])
            require(demand, "D12", f"{e.name()} does not belong into this file")
            require((demand.flags, demand.raw_bytes) == (e.flags, e.raw_bytes), "D12",
                    f"{e.name()}: flags {e.flags}, {e.raw_bytes} bytes instead of {demand.flags}, {demand.raw_bytes}")
            self.described[e.key] = e
        for key, demand in wanted.items():
            require(key in self.described, "D12", f"{demand.name()} is missing")

    def raw(self, entry):
        """The raw bytes of a chunk, after rules C1 to C3."""
        raw = stored = self._read(entry.offset, entry.stored_bytes)
        if entry.codec == 1:
            try:
                check_frame(stored, entry.raw_bytes)
                raw = zstandard.ZstdDecompressor().decompress(stored)
            except Refusal as refusal:
                raise Refusal(refusal.rule, f"{entry.name()}: {refusal.message}") from None
            except zstandard.ZstdError as error:
                raise Refusal("C2", f"{entry.name()}: {error}") from None
            require(len(raw) == entry.raw_bytes, "C2", f"{entry.name()}: {len(raw)} bytes after decompression")
        require(xxhash.xxh3_64_intdigest(raw) == entry.raw_hash, "C3", f"{entry.name()}: raw_hash is wrong")
        return raw

    def chunk(self, kind, part=0, level=0, tile=0):
        """The raw bytes of a chunk that the model demands; empty where the model's formula gives no bytes."""
        entry = self.described.get((kind, part, level, tile))
        return self.raw(entry) if entry else b""

    def check_domain(self):
        if (b"DOMN", 0, 0, 0) in self.described:
            check_domain(self.head, self.chunk(b"DOMN"))

    def check_contents(self):
        """What remains after the constructor: C1 to C3 of all other chunks, the model's rules, M1, QU1, QU2 and P1."""
        for e in self.entries:
            if e.type not in (b"HEAD", b"PARM"):
                self.raw(e)
        self.model.check_contents(self.chunk)
        self.check_domain()
        if (b"META", 0, 0, 0) in self.described:
            check_meta(self.chunk(b"META"))
        if (b"QUAL", 0, 0, 0) in self.described:
            check_quality(self.chunk(b"QUAL"), self.head.pairs)
        end = 64 + 48 * len(self.entries)
        for e in self.entries:
            require(not any(self._read(end, e.offset - end)), "P1", f"padding before {e.name()} is not zero")
            end = e.offset + e.stored_bytes
