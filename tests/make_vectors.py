#!/usr/bin/env python3
"""Makes the decode vectors, and holds what the tests of the command share: images and files by hand.

make_vectors.py --btfc PATH [--source DIR] [MODEL…]   writes tests/vectors/MODEL/*.btfc and a .json beside each

The command makes the files; the expected codes, values and sizes come from tests/reference, which shares no code with
it. The bytes of a vector may change with the encoder, what is decoded from given bytes may not.
"""

import argparse
import json
import random
import struct
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CRITICAL, PAYLOAD, SAFE_TO_COPY = 1, 2, 4
RAW, ZSTD = 0, 1
FIELDS = ("car", "gmrf", "car3d")  # of random fields
MODELS = ("patch", "gm", *FIELDS, "ptm", "plm", "pcarf", "pca", "lpca")
HEADER, ENTRY = "<12sHH4I3Q", "<4sHHQQQQII"


# Images. PNG and TIFF are written here because the command synthesises RGB only.


def write_png(path, width, height, channels, bits, codes):
    """Rows from the top, channels interleaved; 1 to 4 channels of 8 or 16 bits. `codes` are numbers or bytes as in PNG."""
    if not isinstance(codes, (bytes, bytearray)):
        codes = bytes(codes) if bits == 8 else struct.pack(f">{len(codes)}H", *codes)
    row = width * channels * bits // 8
    rows = b"".join(b"\0" + codes[row * y:row * (y + 1)] for y in range(height))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">2I5B", width, height, bits, (0, 4, 2, 6)[channels - 1], 0, 0, 0)
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 1)) +
                           chunk(b"IEND", b""))


def read_png(path):
    """(width, height, channels, bits, codes) of a PNG that is neither interlaced nor has a palette."""
    data, at, packed = Path(path).read_bytes(), 8, b""
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        if name == b"IHDR":
            width, height, bits, colour, _, _, interlaced = struct.unpack_from(">2I5B", data, at + 8)
        if name == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and bits in (1, 8, 16) and not interlaced, path
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    step, raw = max(1, channels * bits // 8), zlib.decompress(packed)
    length = (width * channels * bits + 7) // 8
    previous, out = bytearray(length), bytearray()
    for y in range(height):
        kind, row = raw[y * (length + 1)], bytearray(raw[y * (length + 1) + 1:(y + 1) * (length + 1)])
        for i in range(length) if kind else ():
            left, up = row[i - step] if i >= step else 0, previous[i]
            if kind == 1:
                guess = left
            elif kind == 2:
                guess = up
            elif kind == 3:
                guess = left + up >> 1
            else:
                corner = previous[i - step] if i >= step else 0
                far = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
                guess = (left, up, corner)[far.index(min(far))]
            row[i] = row[i] + guess & 255
        out += row
        previous = row
    if bits == 1:
        ones = [byte >> 7 - i & 1 for byte in out for i in range(8)]
        out = [ones[8 * length * y + x] for y in range(height) for x in range(width * channels)]
    codes = list(out) if bits <= 8 else list(struct.unpack(f">{len(out) // 2}H", out))
    return width, height, channels, bits, codes


def write_tiff(path, width, height, channels, values):
    """Floats, not compressed; a second or fourth channel is straight alpha."""
    fields = [(256, 4, [width]), (257, 4, [height]), (258, 3, [32] * channels), (259, 3, [1]),
              (262, 3, [1 if channels < 3 else 2]), (273, 4, [0]), (277, 3, [channels]), (278, 4, [height]),
              (279, 4, [4 * len(values)]), (284, 3, [1]), (339, 3, [3] * channels)]
    if channels % 2 == 0:
        fields.insert(-1, (338, 3, [2]))
    extra_at = 8 + 2 + 12 * len(fields) + 4
    extra, directory = b"", struct.pack("<H", len(fields))
    for tag, kind, numbers in fields:
        data = struct.pack(f"<{len(numbers)}{'H' if kind == 3 else 'I'}", *numbers)
        if tag == 273:
            data = struct.pack("<I", extra_at + 24)  # the pixels stand after room for the longest arrays
        if len(data) > 4:
            data, extra = struct.pack("<I", extra_at + len(extra)), extra + data
        directory += struct.pack("<HHI", tag, kind, len(numbers)) + data.ljust(4, b"\0")
    assert len(extra) <= 24
    Path(path).write_bytes(b"II*\0" + struct.pack("<I", 8) + directory + bytes(4) + extra.ljust(24, b"\0") +
                           struct.pack(f"<{len(values)}f", *values))


def half(code):
    return struct.unpack("<e", struct.pack("<H", code))[0]


def noise(count, bits, seed):
    rng = random.Random(seed)
    return [rng.randrange(1 << bits) for _ in range(count)]


def half_noise(count, seed):
    """Finite half floats of all sizes, with zeros of both signs and subnormals."""
    rng = random.Random(seed)
    special = [0, 0x8000, 1, 0x8001, 0x3ff, 0x83ff, 0x7bff, 0xfbff, 0x3c00]
    return [rng.choice(special) if rng.random() < 0.2 else rng.randrange(0x7c00) | rng.randrange(2) << 15
            for _ in range(count)]


# Files of the format, taken apart and put together.


@dataclass
class Chunk:
    type: bytes
    flags: int
    codec: int
    raw_bytes: int
    raw_hash: int
    key_a: int
    tile: int
    stored: bytes

    def rank(self):
        group = 2 if not self.flags & CRITICAL else 1 if self.flags & PAYLOAD else 0
        return group, self.key_a >> 16, self.key_a >> 8 & 255, self.type, self.key_a & 255, self.tile


def hash_of(data):
    import xxhash  # not every test needs it
    return xxhash.xxh3_64_intdigest(data)


def raw_chunk(kind, flags, raw, part=0):
    return Chunk(kind, flags, RAW, len(raw), hash_of(raw), part, 0, raw)


def read_chunks(data):
    chunks = []
    for i in range(struct.unpack_from("<I", data, 24)[0]):
        kind, flags, codec, offset, stored, raw, digest, key_a, key_b = struct.unpack_from(ENTRY, data, 64 + 48 * i)
        chunks.append(Chunk(kind, flags, codec, raw, digest, key_a, key_b, data[offset:offset + stored]))
    return chunks


def rehash(data):
    """The same bytes with directory_hash made right."""
    end = min(64 + 48 * struct.unpack_from("<I", data, 24)[0], len(data))
    return data[:56] + struct.pack("<Q", hash_of(data[:56] + data[64:end])) + data[64:]


def build_file(chunks, align=16, minor=1):
    """A file of the chunks in canonical order, with offsets, sizes and the directory's hash right."""
    chunks = sorted(chunks, key=Chunk.rank)
    at, index, body = 64 + 48 * len(chunks), b"", b""
    for c in chunks:
        offset = -(-at // align) * align
        body += bytes(offset - at) + c.stored
        index += struct.pack(ENTRY, c.type, c.flags, c.codec, offset, len(c.stored), c.raw_bytes, c.raw_hash, c.key_a,
                             c.tile)
        at = offset + len(c.stored)
    payload = sum(c.raw_bytes for c in chunks if c.flags & PAYLOAD)
    magic = bytes.fromhex("AB 42 54 46 43 20 31 BB 0D 0A 1A 0A")
    header = struct.pack(HEADER, magic, 0, minor, 0, 0, len(chunks), align.bit_length() - 1, at, payload, 0)
    return rehash(header + bytes(8) + index + body)


# The vectors.


def grey8(folder, width, height):
    return image(folder, 1, 8, width, height)


def image(folder, channels, bits, width, height, seed=1):
    """A sample of noise as PNG, or as TIFF of floats where bits is 'half'."""
    path = Path(folder, f"{channels}-{bits}-{width}x{height}-{seed}.{'tif' if bits == 'half' else 'png'}")
    count = width * height * channels
    if bits == "half":
        write_tiff(path, width, height, channels, [half(code) for code in half_noise(count, seed)])
    else:
        write_png(path, width, height, channels, bits, noise(count, bits, seed))
    return str(path)


def patch_recipes(btfc, folder):
    """Name -> arguments of encode."""

    def synth(kind, size, sample_type="unorm8"):
        path = str(Path(folder, f"{kind}-{size}.{'exr' if sample_type == 'float16' else 'png'}"))
        subprocess.run([btfc, "synth", kind, "-o", path, "--size", size, "--type", sample_type], check=True)
        return path

    annotated = str(Path(folder, "annotated.png"))
    write_png(annotated, 2, 2, 1, 8, [10, 20, 30, 40])
    liang, quilting = ["--blend", "liang"], ["--blend", "quilting"]
    packed, bytewise = [*quilting, "--pack", "packed"], [*quilting, "--pack", "rgba8"]
    raw = ["--codec", "raw"]
    return {
        "annotated": [annotated, "--k", "1", "--we", "0", "--wb", "2", *liang, *raw],
        "liang_rgb8": [synth("bricks", "24x24"), "--k", "4", "--wb", "12", "--we", "3", *liang, *raw],
        "packed_rgb8": [synth("weave", "24x24"), "--k", "4", "--wb", "11", "--we", "5", *packed, *raw],
        "bytewise_rgb8": [synth("pebbles", "24x24"), "--k", "4", "--wb", "11", "--we", "5", *bytewise],
        "liang_grey_alpha8": [image(folder, 2, 8, 20, 17), "--size", "61x47", "--wb", "9", "--we", "2", *liang],
        "packed_rgba8": [image(folder, 4, 8, 19, 23), "--size", "53x71", "--wb", "13", "--we", "6", *packed],
        "liang_rgb16": [synth("grain", "20x20", "unorm16"), "--k", "3x5", "--wb", "8", "--we", "3", *liang],
        "bytewise_grey16": [image(folder, 1, 16, 31, 18), "--size", "67x41", "--wb", "14", "--we", "4", *bytewise],
        "liang_float16": [synth("pebbles", "22x22", "float16"), "--k", "4x3", "--wb", "10", "--we", "4", *liang],
        "packed_float16_rgba": [image(folder, 4, "half", 16, 16), "--k", "3", "--wb", "8", "--we", "3", *packed, *raw],
        "liang_float16_grey": [image(folder, 1, "half", 24, 16), "--size", "40x60", "--wb", "9", "--we", "4", *liang,
                               *raw],
        "liang_wide": [grey8(folder, 257, 8), "--size", "97x29", "--wb", "8", "--we", "3", *liang],
        "packed_wide": [grey8(folder, 8, 257), "--k", "2x9", "--wb", "8", "--we", "2", *packed, *raw],
        "single_patch": [synth("tiles", "16x16"), "--k", "1", "--wb", "16", "--we", "0", *quilting, "--size", "15x9"],
        "overlap_one": [grey8(folder, 18, 18), "--k", "5x2", "--wb", "7", "--we", "1", *packed, *raw],
        "overlap_half": [synth("weave", "18x18"), "--k", "5", "--wb", "8", "--we", "4", *bytewise],
        "overlap_half_liang": [synth("tiles", "18x18"), "--k", "1x6", "--wb", "8", "--we", "4", *liang],
        "two_maps": ["--map", "albedo=" + synth("bricks", "21x19"), "--map", "height=" + image(folder, 1, 16, 21, 19),
                     "--size", "64x33", "--wb", "10", "--we", "3", *packed],
        "tileable_liang": [synth("grain", "22x22"), "--k", "3x2", "--wb", "10", "--we", "4", "--tileable", *liang],
        "tileable_packed": [synth("weave", "22x22"), "--k", "4", "--wb", "9", "--we", "3", "--tileable", *packed, *raw],
        "tileable_one": [grey8(folder, 14, 14), "--k", "1", "--wb", "12", "--we", "5", "--tileable", *bytewise, *raw],
        "tileable_two": [grey8(folder, 14, 14), "--k", "2", "--wb", "8", "--we", "4", "--tileable", *packed],
        "trimmed_packed": [synth("pebbles", "33x30"), "--k", "3", "--wb", "9", "--we", "3", "--trim-sample", *packed],
        "trimmed_liang_float16": [synth("bricks", "33x30", "float16"), "--k", "2", "--wb", "9", "--we", "3",
                                  "--trim-sample", *liang, *raw],
        "trimmed_tileable_maps": ["--map", "a=" + synth("tiles", "30x30"), "--map", "b=" + image(folder, 1, 16, 30, 30),
                                  "--k", "2x3", "--wb", "10", "--we", "3", "--trim-sample", "--tileable", *packed],
    }


def btf_recipes(model, folder):
    """Name -> arguments of encode, for a model of BTFs."""
    import btf_sets as sets

    def made(name, *args, **more):
        return sets.write_set(Path(folder, f"{model}-{name}"), *args, **more)

    def precision(texels, tables, rank, clusters):
        if model == "ptm":
            return ["--precision", texels]
        if model == "plm":
            more = ["--clusters", str(clusters)] if clusters > 2 else []
            more += ["--polynomial", ("none", "histogram", "least-squares")[min(rank, 2)]]
            return ["--precision", texels, "--table-precision", tables, *more]
        more = ["--clusters", str(clusters)] if model == "lpca" else []
        return ["--precision", texels, "--table-precision", tables, "--rank", str(rank), *more]

    few = sets.RING[:3]
    gone = {(0, 1), (1, 2), (2, 0), (2, 2), (4, 1), (4, 2), (4, 3)}
    named = sets.write_named_set(Path(folder, f"{model}-named"), sets.RING, sets.RING, (4, 3), missing=gone)
    lights = sets.SIDE[:4] if model == "pcarf" else sets.SIDE
    return {
        "rgb8_f32": [made("rgb8", sets.RING, sets.RING, (5, 3)), *precision("f32", "f32", 1, 2), "--codec", "raw"],
        "grey16_f16": [made("grey16", sets.HORIZON, sets.GRID, (6, 4), 1, "unorm16"),
                       *precision("f16", "f16", 2, 3), "--codec", "zstd"],
        "spectral_u8": [made("spectral", few, sets.HORIZON, (5, 4), 5, "float16", peak=6.0),
                        *precision("u8", "u8", 2, 2), "--codec", "raw"],
        # The smallest of ptm and plm: hostile_test changes its every byte, so nothing is packed in it.
        "single": [made("single", [(25, 70)], [(50, 200)], (7, 5)),
                   *precision("u8" if model in ("ptm", "plm") else "f32", "u8", 0, 1),
                   "--codec", "raw" if model in ("ptm", "plm") else "zstd"],
        "line_wraps": [made("line", sets.LINE, lights, (4, 3), wraps=True), *precision("u8", "f32", 2, 4),
                       "--codec", "zstd"],
        "missing": [named, *precision("f16", "u8", 3, 12), "--missing", "skip", "--codec", "raw"],
        "few_float16": [made("half", sets.GRID[:4], sets.RING[1:], (3, 4), 3, "float16", peak=40.0,
                             missing={(0, 0), (1, 2), (3, 3)}),
                        *precision("f32", "f16", 3, 12 if model == "lpca" else 1), "--codec", "zstd"],
    }


def gm_recipes(folder):
    """As btf_recipes; the fits are short, as what they reach does not matter here."""
    import btf_sets as sets

    def made(name, *args, **more):
        return sets.write_set(Path(folder, f"gm-{name}"), *args, **more)

    def mixture(components, levels, gates, precision, mean, shear, *more):
        fit = [] if "em" in more else ["--iterations", "300"]
        return ["--components", str(components), "--levels", str(levels), "--gates", str(gates), "--precision",
                precision, "--mean-brdf", mean, "--shear", shear, *fit, *more]

    em, rank = ["--fit", "em", "--iterations", "10"], ["--mean-rank", "3"]
    gone = {(0, 1), (1, 2), (2, 0), (2, 2), (4, 1), (4, 2), (4, 3)}
    named = sets.write_named_set(Path(folder, "gm-named"), sets.RING, sets.RING, (4, 3), missing=gone)
    few = {(0, 0), (1, 2), (3, 3)}
    return {
        "rgb8_f32": [made("rgb8", sets.RING, sets.RING, (5, 3)), *mixture(13, 3, 0, "f32", "f32", "off", *em),
                     "--codec", "raw"],
        "grey16_f16": [made("grey16", sets.HORIZON, sets.GRID, (6, 4), 1, "unorm16"),
                       *mixture(21, 1, 3, "f16", "u8", "on"), "--codec", "zstd"],
        # The smallest: hostile_test changes its every byte, so nothing is packed in it.
        "single": [made("single", [(25, 70)], [(50, 200)], (7, 5)), *mixture(1, 1, 0, "u8", "u8", "on"),
                   "--codec", "raw"],
        "line_wraps": [made("line", sets.LINE, sets.SIDE, (4, 3), wraps=True),
                       *mixture(40, 4, 5, "u8", "coded", "on", *rank), "--codec", "zstd"],
        "missing": [named, *mixture(17, 3, 0, "f16", "u8", "off"), "--missing", "skip", "--codec", "raw"],
        # Half floats: the logarithm is fitted.
        "few_float16": [made("half", sets.GRID[:4], sets.RING[1:], (3, 4), 4, "float16", peak=40.0, missing=few),
                        *mixture(13, 2, 3, "f16", "f32", "on"), "--codec", "zstd"],
        "log_wraps": [made("log", sets.RING, sets.GRID[:4], (5, 4), 3, "float16", peak=6.0, wraps=True),
                      *mixture(17, 3, 0, "u8", "coded", "on", *rank), "--codec", "zstd"],
        "paper": [made("paper", sets.RING, sets.HORIZON, (6, 4), wraps=True), "--layout", "paper", "--onion", "printed", "--components", "14",
                  "--mean-brdf", "u8", *em, "--codec", "raw"],
    }


def field_recipes(model, folder):
    """As btf_recipes. Material without much structure and coarse errors: recursions that die away fast."""
    import btf_sets as sets

    def made(name, *args, **more):
        return sets.write_set(Path(folder, f"{model}-{name}"), *args, **more)

    def statistics(levels, order, knots, precision):
        torus = ["--torus", str(32 if levels < 3 else 64)] if model == "gmrf" else []
        return ["--levels", str(levels), "--order", str(order), "--knots", str(knots), "--precision", precision,
                "--error", "0.02", *torus]

    def fields(clusters, levels, order, knots, precision, *relief):
        return [*statistics(levels, order, knots, precision), "--clusters", str(clusters), "--range",
                relief[0] if relief else "0", *(["--range-bits", relief[1]] if relief else [])]

    gone = {(0, 1), (1, 2), (2, 0), (2, 2), (4, 1), (4, 2), (4, 3)}
    named = sets.write_named_set(Path(folder, f"{model}-named"), sets.RING, sets.RING, (18, 14), missing=gone)
    return {
        "rgb8_f32": [made("rgb8", sets.RING, sets.RING, (24, 20)), *fields(3, 2, 2, 0, "f32", "6x5", "8"), "--codec", "raw"],
        "grey16_f16": [made("grey16", sets.HORIZON, sets.GRID, (20, 16), 1, "unorm16"),
                       *fields(5, 1, 2, 17, "f16", "7x3", "16"), "--codec", "zstd"],
        # The smallest: hostile_test changes its every byte, so nothing is packed in it.
        "single": [image(folder, 1, 8, 12, 12), *statistics(1, 1, 0, "f16"), "--codec", "raw"],
        "image_rgb": [image(folder, 3, 8, 40, 33), *statistics(3, 3, 16, "f16"), "--seed", "4294967295", "--codec", "zstd"],
        "two_maps": ["--map", "albedo=" + image(folder, 3, 8, 24, 24, 2), "--map", "height=" + image(folder, 1, 16, 24, 24, 3),
                     *statistics(2, 1, 2, "f32"), "--seed", "7", "--codec", "raw"],
        "line_wraps": [made("line", sets.LINE, sets.SIDE, (16, 16), wraps=True), *fields(2, 2, 2, 64, "f16"),
                       "--codec", "zstd"],
        "missing": [named, *fields(4, 2, 1, 5, "f16", "4x4", "8"), "--missing", "skip", "--codec", "raw"],
        "few_float16": [made("half", sets.GRID[:4], sets.RING[1:], (16, 13), 3, "float16", peak=40.0,
                             missing={(0, 0), (1, 2), (3, 3)}), *fields(2, 1, 0, 9, "f32"), "--codec", "zstd"],
    }


def recipes(model, btfc, folder):
    if model == "patch":
        return patch_recipes(btfc, folder)
    if model in FIELDS:
        return field_recipes(model, folder)
    return gm_recipes(folder) if model == "gm" else btf_recipes(model, folder)


def expected(path):
    """What the independent reader finds in a file."""
    import btfc_reference as reference
    with open(path, "rb") as stream:
        item, numbers, maps = reference.open_item(stream), reference.info(stream, None), []
        for number, m in enumerate(item.head.maps):
            row = {"name": m.name, "channels": m.channels, "sample_type": numbers["maps"][number]["sample_type"]}
            maps.append(row)
            if item.model.VALUES:
                continue
            bands = list(reference.decode_region(item, number, 0, 0, item.head.width, item.head.height))
            codes = b"".join(band.astype("u1" if m.bits == 8 else "<u2").tobytes() for band in bands)
            first = [[int(c) for c in texel] for texel in bands[0].reshape(-1, m.channels)[:4]]
            row.update({"xxh3_64": f"{hash_of(codes):016x}", "first_texels": first})
        keys = ("width", "height", "payload_bits", "formula_bits", "memory_bits", "file_bytes")
        out = {**{key: numbers[key] for key in keys}, "maps": maps}
        if item.model.VALUES:
            import btf_sets as sets
            out = {**{key: numbers[key] for key in ("views", "lights", "pairs", "paper_bits")}, **out}
            out["largest"] = item.model.largest()
            out["queries"] = sets.queries_of(item)
            for q in out["queries"]:
                values = reference.value(item, q["map"], q["x"], q["y"], q["view"], q["light"])
                q["values"] = [float(f"{v:.12g}") for v in values]
    return out


def write_vectors(model, args):
    target = args.source / "tests/vectors" / model
    target.mkdir(parents=True, exist_ok=True)
    for old in [*target.glob("*.btfc"), *target.glob("*.json")]:
        old.unlink()
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in recipes(model, args.btfc, folder).items():
            path = target / f"{name}.btfc"
            subprocess.run([args.btfc, "encode", *arguments, "-o", path, "--model", model, "--json"], check=True,
                           stdout=subprocess.DEVNULL)
            numbers = expected(path)
            text = json.dumps(numbers).replace('"queries": [', '"queries": [\n').replace('}, {"map"', '},\n{"map"')
            path.with_suffix(".json").write_text(text + "\n")
            print(f"{model:5} {name:20} {numbers['width']}x{numbers['height']} {numbers['file_bytes']} bytes")
            if numbers["file_bytes"] > 8192:
                sys.exit(f"{name} is above 8 KiB")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--source", type=Path, default=ROOT)
    parser.add_argument("models", nargs="*", metavar="MODEL", help=f"of {', '.join(MODELS)}; default all")
    args = parser.parse_args()
    sys.path.insert(0, str(args.source / "tests/reference"))
    for model in args.models or MODELS:
        write_vectors(model, args)


if __name__ == "__main__":
    main()
