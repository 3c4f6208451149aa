"""Files that break the rules of spec/tables.md and of the pages of pcarf, pca and lpca, one rule each, made from the
decode vectors. spec/conformance.md lists them; gm_faults.py has those of gm, field_faults.py those of car, gmrf
and car3d."""

import struct

import make_vectors as files

LETTERS = {"pcarf": "PF", "pca": "PC", "lpca": "LP"}
PAIRS_AT, WIDTH_AT, VIEWS_AT, UNBOUNDED_AT, TRANSFORM_AT = 20, 4, 12, 28, 30  # in HEAD
F32, F16, U8 = 0, 1, 2


def with_chunk(chunks, kind, change, key_a=None, tile=0):
    """The file with one chunk's raw bytes changed, all hashes right."""
    import zstandard
    out = []
    for c in chunks:
        if c.type == kind and (key_a is None or (c.key_a, c.tile) == (key_a, tile)):
            raw = zstandard.ZstdDecompressor().decompress(c.stored) if c.codec else c.stored
            new = files.raw_chunk(c.type, c.flags, change(bytearray(raw)), c.key_a)
            new.tile = c.tile
            c = new
        out.append(c)
    return files.build_file(out)


def put(at, form, *values):
    """A change: values written at a place, counted from the end where it is negative."""
    def change(raw):
        struct.pack_into(form, raw, at % len(raw), *values)
        return bytes(raw)
    return change


def swap(a, b, size):
    def change(raw):
        raw[a:a + size], raw[b:b + size] = raw[b:b + size], raw[a:a + size]
        return bytes(raw)
    return change


def copied(source, target, size):
    def change(raw):
        raw[target:target + size] = raw[source:source + size]
        return bytes(raw)
    return change


def without_last_light(start, head):
    """Pairs of the last light become ones of lights before it that the view has not."""
    def change(raw):
        pairs = set(struct.iter_unpack("<2H", bytes(raw[start:])))
        for view, light in sorted(pairs):
            if light == head.lights - 1:
                pairs.remove((view, light))
                pairs.add(next((v, l) for v in range(head.views) for l in range(light) if (v, l) not in pairs))
        return bytes(raw[:start]) + b"".join(struct.pack("<2H", *pair) for pair in sorted(pairs))
    return change


def domain_faults(chunks):
    """Those of DOMN (btfc.md 5.4), which any file may have: views in a range, two lights listed."""
    sound = struct.pack("<4B2f2I2f2I8f", 1, 2, 0, 0, 0.03, 0, 0, 0, 0, 4, 0, 2, 0.25, 0.5, 0, 1, 0, 0, 0, 0)
    sound += struct.pack("<4i", 0, 0, 1 << 20, 0)

    def broken(change):
        return files.build_file(chunks + [files.raw_chunk(b"DOMN", 0, change(bytearray(sound)))])

    yield "DM1", "DOMN too short", broken(lambda raw: bytes(raw[:67]))
    yield "DM1", "DOMN entries missing", broken(lambda raw: bytes(raw[:76]))
    yield "DM1", "DOMN 65537 views", broken(put(28, "<I", 65537))
    yield "DM2", "DOMN kind", broken(put(0, "B", 4))
    yield "DM2", "DOMN pairs of views alone", broken(put(0, "B", 3))
    yield "DM2", "DOMN list without entries", broken(lambda raw: bytes(raw[:32] + bytes(4) + raw[36:68]))
    yield "DM2", "DOMN range of another kind", broken(put(0, "B", 0))
    yield "DM2", "DOMN scale", broken(put(2, "B", 17))
    yield "DM2", "DOMN reserved", broken(put(3, "B", 1))
    yield "DM3", "DOMN tolerance not a number", broken(put(4, "<f", float("nan")))
    yield "DM3", "DOMN footprints in reverse", broken(put(24, "<f", -1))
    yield "DM3", "DOMN theta in reverse", broken(put(40, "<f", 0.125))
    yield "DM4", "DOMN point below the horizon", broken(put(80, "<I", 1 << 31))
    yield "DM5", "DOMN beyond 2^32", broken(put(12, "<I", 0xffffffff))


def direction_faults(chunks, head):
    """Those of tables.md that concern every model; chunks and HEAD of each vector by its name."""
    plain, some = chunks["rgb8_f32"], chunks["missing"]  # all pairs; not all
    start, beyond = 8 * (head["missing"].views + head["missing"].lights), (1 << 24) + 1

    yield "V1", "1025 views", with_chunk(plain, b"HEAD", put(VIEWS_AT, "<3I", 1025, 1, 1025))
    yield "V1", "1025 lights", with_chunk(plain, b"HEAD", put(VIEWS_AT, "<3I", 1, 1025, 1025))
    yield "V1", "fewer pairs than views", with_chunk(plain, b"HEAD", put(PAIRS_AT, "<I", head["rgb8_f32"].views - 1))
    yield "V1", "more pairs than there are", with_chunk(plain, b"HEAD", put(PAIRS_AT, "<I", head["rgb8_f32"].pairs + 1))
    yield "V2", "short DIRS", with_chunk(plain, b"DIRS", lambda raw: bytes(raw[:-4]))
    yield "V2", "pairs though all are there", with_chunk(plain, b"DIRS", lambda raw: bytes(raw) + bytes(
        4 * head["rgb8_f32"].pairs))
    yield "V3", "point below the horizon", with_chunk(plain, b"DIRS", put(0, "<2i", beyond, 0))
    yield "V3", "point far below the horizon", with_chunk(plain, b"DIRS", put(4, "<i", -1 << 31))
    yield "V3", "two views alike", with_chunk(plain, b"DIRS", copied(0, 8, 8))
    lights = 8 * head["rgb8_f32"].views
    yield "V3", "two lights alike", with_chunk(plain, b"DIRS", copied(lights, lights + 8, 8))
    yield "V4", "view of a pair", with_chunk(some, b"DIRS", put(-4, "<H", head["missing"].views))
    yield "V4", "light of a pair", with_chunk(some, b"DIRS", put(-2, "<H", head["missing"].lights))
    yield "V4", "pairs not ascending", with_chunk(some, b"DIRS", swap(start, start + 4, 4))
    yield "V4", "light in no pair", with_chunk(some, b"DIRS", without_last_light(start, head["missing"]))
    yield "V4", "pair repeated", with_chunk(some, b"DIRS", copied(start, start + 4, 4))


def faults(model, vectors, open_file):
    """(rule, name, bytes); vectors: name -> bytes; open_file: the reference reader's."""
    chunks = {name: files.read_chunks(data) for name, data in vectors.items()}
    head = {name: open_file(data).head for name, data in vectors.items()}
    yield from direction_faults(chunks, head)
    if model == "pca":
        yield from domain_faults(chunks["rgb8_f32"])
    plain, letters = chunks["rgb8_f32"], LETTERS[model]
    yield "V5", "unbounded", with_chunk(plain, b"HEAD", put(UNBOUNDED_AT, "B", 1))
    yield "V5", "value transform", with_chunk(plain, b"HEAD", put(TRANSFORM_AT, "B", 1))

    at = 4 if model == "lpca" else 0  # of rank in PARM
    yield letters + "1", "PARM size", with_chunk(plain, b"PARM", lambda raw: bytes(raw) + bytes(4))
    yield letters + "1", "rank 256", with_chunk(plain, b"PARM", put(at, "<I", 256))
    yield letters + "1", "texel precision", with_chunk(plain, b"PARM", put(at + 4, "B", 3))
    yield letters + "1", "table precision", with_chunk(plain, b"PARM", put(at + 5, "B", 3))
    yield letters + "1", "PARM reserved", with_chunk(plain, b"PARM", put(at + 6, "<H", 1))
    if model == "lpca":
        yield "LP1", "no clusters", with_chunk(plain, b"PARM", put(0, "<I", 0))
        yield "LP1", "65537 clusters", with_chunk(plain, b"PARM", put(0, "<I", 65537))
    yield letters + "2", "chunk above 2^27", with_chunk(plain, b"HEAD", put(WIDTH_AT, "<2I", 65536, 65536))

    # The first array of each precision, and the first of each with padding.
    first, padded = {}, {}
    for name, data in vectors.items():
        for kind, level, tile, rows, columns, precision in open_file(data).model.arrays():
            place = chunks[name], kind, level << 8, tile
            first.setdefault(precision, place)
            size = (8 * rows if precision == U8 else 0) + rows * columns * (4, 2, 1)[precision]
            if size % 4:
                padded.setdefault(precision, place)

    def broken(place, change):
        return with_chunk(place[0], place[1], change, *place[2:])

    rule = letters + "3"
    yield rule, "f32 not a number", broken(first[F32], put(0, "<f", float("nan")))
    yield rule, "f32 infinite", broken(first[F32], put(-4, "<f", float("-inf")))
    yield rule, "f32 above 2^32", broken(first[F32], put(0, "<I", 0x4f800001))
    yield rule, "f16 infinite", broken(first[F16], put(0, "<H", 0x7c00))
    yield rule, "f16 not a number", broken(first[F16], put(0, "<H", 0xfe00))
    yield rule, "u8 offset not a number", broken(first[U8], put(0, "<f", float("nan")))
    yield rule, "u8 offset below -2^32", broken(first[U8], put(0, "<I", 0xcf800001))
    yield rule, "u8 step below 0", broken(first[U8], put(4, "<f", -1e-30))
    yield rule, "u8 step above 2^32", broken(first[U8], put(0, "<2f", -2.0 ** 32, 2.0 ** 33))
    yield rule, "u8 end above 2^32", broken(first[U8], put(0, "<2f", 2.0 ** 31, 2.0 ** 24))
    for precision, what in ((F16, "f16 padding"), (U8, "u8 padding")):
        if precision in padded:
            yield rule, what, broken(padded[precision], put(-1, "B", 1))
    if model == "lpca":
        yield "LP4", "cluster outside", with_chunk(plain, b"CLUS", put(0, "B", 2))
        name = next(name for name, h in head.items() if h.width * h.height % 4)
        yield "LP4", "CLUS padding", with_chunk(chunks[name], b"CLUS", put(-1, "B", 1))
