"""Rows of the table of extremes that the command itself answers: sizes at the caps, inputs that are refused, files that lie."""

import json
import math
import struct
import subprocess

import btf_sets as sets
import btfc_reference as reference
import make_vectors as files
from btfc_container import Refusal, parse_head

FIELD = ["--levels", "2", "--order", "2", "--knots", "0", "--precision", "f32", "--clusters", "3", "--range", "6x5"]
WEIGHTED = ["--precision", "f32", "--table-precision", "f32", "--rank", "1"]
# What the vectors rgb8_f32 were made with: their PARM at other sizes is what these options ask for.
OPTIONS = {
    "gm": ["--components", "13", "--levels", "3", "--precision", "f32", "--mean-brdf", "f32", "--shear", "off"],
    "car": FIELD,
    "ptm": ["--precision", "f32"],
    "plm": ["--precision", "f32", "--table-precision", "f32"],
    "pcarf": WEIGHTED,
    "pca": WEIGHTED,
    "lpca": [*WEIGHTED, "--clusters", "2"],
    "gmrf": [*FIELD, "--torus", "32"],
    "car3d": FIELD,
}

class Runner:
    def __init__(self, btfc, source, folder):
        self.btfc, self.source, self.folder, self.rows = btfc, source, folder, []

    def run(self, *args):
        return subprocess.run([self.btfc, *map(str, args)], capture_output=True, text=True)

    def refused(self, model, extreme, status, *args, must=()):
        """The command ends with the status and one sentence, which names what it must."""
        done = self.run(*args)
        said = done.stderr.strip().replace(f"{self.folder}/", "")
        good = done.returncode == status and "\n" not in said and len(said.split()) >= 5
        good = good and all(word in said for word in must) and done.stdout == ""
        self.rows.append((model, extreme, f"refused, exit code {status}", said or "accepted", good, True))

    def add(self, model, extreme, required, measured, good, message=True):
        self.rows.append((model, extreme, required, measured, good, message))


# ---- Sizes


def description(source, model):
    data = (source / "tests/vectors" / model / "rgb8_f32.btfc").read_bytes()
    chunks = {c.type: c.stored for c in files.read_chunks(data)}
    return chunks[b"HEAD"], chunks[b"PARM"]


def formula(source, model, side, views):
    """The reference's formula in whole numbers of any length; nothing where it refuses the size."""
    head, parm = description(source, model)
    head = head[:4] + struct.pack("<5I", side, side, views, views, views * views) + head[24:]
    classes = {number: reference.model_class(name) for number, name in reference.MODELS.items()}
    try:
        parsed = parse_head(head, classes)
        return classes[parsed.model](parsed, parm).formula_bits()
    except Refusal:
        return None


def sizes(runner):
    """The largest square that the reference finds within the limits, and one texel a side more."""
    for model, options in OPTIONS.items():
        views = 1024 if model in (*files.FIELDS, "gm") else 101
        side, most = 1, 65536  # by halving
        while side < most:
            middle = (side + most + 1) // 2
            side, most = (middle, most) if formula(runner.source, model, middle, views) else (side, middle - 1)
        done = runner.run("size", "--model", model, *options, "--channels", "3", "--views", views, "--lights", views, "--sweep",
                          f"size={side}:{side + 1}:1", "--json")
        fits, above = json.loads(done.stdout)["points"]
        bits = fits.get("formula_bits")
        runner.add(model, "the largest that the limits allow, by `size`", "formula_bits as in whole numbers of any length",
                   f"{side}x{side} texels, {views}x{views} directions: {bits} bits", bits == formula(runner.source, model, side, views))
        said = above.get("error", "accepted")
        runner.add(model, "one texel a side more, by `size`", "refused, and the limit named", said, "2^27" in said or "65536" in said)
    side = math.isqrt((1 << 27) // 4)  # a plane has four bytes a texel
    patch = ["size", "--model", "patch", "--blend", "liang", "--k", "11", "--wb", "5780", "--we", "2"]
    said = json.loads(runner.run(*patch, "--sample", f"{side}x{side}", "--json").stdout)
    runner.add("patch", "the largest that the limits allow, by `size`", "formula_bits as in whole numbers of any length",
               f"a sample of {side}x{side} for {said['width']}x{said['height']} texels: {said['formula_bits']} bits",
               said["formula_bits"] == 8 * (32 + -(-3 * side * side // 4) * 4 + 4 * 11 * 11))
    runner.refused("patch", "one texel a side more, by `size`", 1, *patch, "--sample", f"{side + 1}x{side + 1}", must=["2^27"])
    runner.refused("patch", "65,537 texels wide, by `size`", 1, "size", "--model", "patch", "--sample", "64x64", "--size",
                   "65537x4", must=["65536"])


# ---- Inputs


def not_finite(runner):
    picture, out = runner.folder / "odd.tif", runner.folder / "out.btfc"
    values = [0.5] * (8 * 6 * 3)
    for x, y, channel, value in ((3, 2, 1, math.nan), (5, 4, 0, math.inf)):
        values[(y * 8 + x) * 3 + channel] = value
    files.write_tiff(picture, 8, 6, 3, values)
    images = []
    for view in (0, 40):
        for light in (0, 30):
            name = f"v{view}l{light}.tif"
            files.write_tiff(runner.folder / name, 8, 6, 3, values if view and light else [0.5] * len(values))
            images.append({"file": name, "view": [view, 0], "light": [light, 90]})
    stack = runner.folder / "odd.json"
    stack.write_text(json.dumps({"images": images}))
    for model in ("patch", *OPTIONS):
        source = picture if model == "patch" else stack
        runner.refused(model, "samples that are not a number, or infinite", 3, "encode", source, "-o", out, "--model", model,
                       *(["--k", "2"] if model == "patch" else []), must=["2 samples", "(3, 2)", "channel 1", "nan"])
    files.write_tiff(picture, 8, 6, 3, [0.5] * 100 + [65520.0] + [0.5] * 43)
    runner.refused("patch", "a sample beyond half floats, 65520", 3, "encode", picture, "-o", out, "--model", "patch", "--k", "2",
                   must=["65520", "(1, 4)"])
    set_path = sets.write_set(runner.folder / "set", sets.RING[:2], sets.RING[:2], (5, 4))
    runner.refused("patch", "a BTF", 1, "encode", set_path, "-o", out, "--model", "patch", "--k", "2")
    runner.add("all", "after a refusal", "no file, whole or half", "none" if not out.exists() else "a file", not out.exists())


def odd_sets(runner):
    out = runner.folder / "out.btfc"
    small, large = runner.folder / "small.png", runner.folder / "large.png"
    files.write_png(small, 8, 6, 3, 8, files.noise(144, 8, 1))
    files.write_png(large, 9, 6, 3, 8, files.noise(162, 8, 2))

    def stack(name, rows):
        path = runner.folder / f"{name}.json"
        path.write_text(json.dumps({"images": [{"file": f, "view": v, "light": l} for f, v, l in rows]}))
        return path

    pca = ["-o", out, "--model", "pca", "--rank", "1"]
    runner.refused("readers", "images of two sizes", 3, "encode",
                   stack("sizes", [("small.png", [0, 0], [0, 0]), ("large.png", [0, 0], [30, 0])]), *pca, must=["large.png", "9x6"])
    runner.refused("readers", "one pair of directions twice, as 0 and as 360 degrees", 3, "encode",
                   stack("twice", [("small.png", [30, 0], [0, 0]), ("small.png", [30, 360], [0, 0])]), *pca)
    path = stack("turns", [("small.png", [30, 360], [0, 0]), ("small.png", [30, -180], [0, 0])])
    done = runner.run("encode", path, *pca, "--json")
    info = json.loads(runner.run("info", out, "--json").stdout) if done.returncode == 0 else {}
    runner.add("readers", "azimuths of 360 and -180 degrees", "two views", f"{info.get('views')} views", info.get("views") == 2)
    runner.refused("readers", "a view below the surface", 3, "encode", stack("below", [("small.png", [120, 0], [0, 0])]), *pca)
    runner.refused("patch", "maps of two sizes", 1, "encode", "--map", f"a={small}", "--map", f"b={large}", "-o", out, "--model",
                   "patch", "--k", "2", must=["'b'", "9x6", "8x6"])


# ---- Outputs and files


def outputs(runner):
    vector = runner.source / "tests/vectors/pca/rgb8_f32.btfc"
    runner.refused("all", "an output folder that is not there", 2, "copy", vector, "-o", "/nowhere/out.btfc", must=["/nowhere"])
    target = runner.folder / "kept.btfc"
    target.write_bytes(b"what was there")
    done = subprocess.run(["sh", "-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh", runner.btfc, "copy", vector, "-o", target],
                          capture_output=True, text=True)
    said = done.stderr.strip().replace(f"{runner.folder}/", "")
    kept = target.read_bytes() == b"what was there" and not [p for p in runner.folder.iterdir() if p.name.startswith(".")]
    runner.add("all", "a full disk", "refused, exit code 2; what was there stays", f"{said}; it {'stays' if kept else 'is gone'}",
               done.returncode == 2 and kept)


def lies(runner):
    data = (runner.source / "tests/vectors/patch/liang_rgb8.btfc").read_bytes()
    chunks = files.read_chunks(data)
    path = runner.folder / "lie.btfc"

    def put(what, at, form, value):
        return files.rehash(what[:at] + struct.pack(form, value) + what[at + struct.calcsize(form):])

    def with_chunk(name, change):
        return files.build_file([files.Chunk(**{**vars(c), **change(c)}) if c.type == name else c for c in chunks])

    import zstandard

    def frames(c):
        return zstandard.ZstdCompressor(level=19).compress(c.stored)

    def lying(c):
        # The content size of a frame with a single segment stands after magic and descriptor.
        frame = bytearray(frames(c))
        frame[5] ^= 1
        return bytes(frame)

    faults = {
        "no byte": b"",
        "cut by one byte": data[:-1],
        "a byte too many": data + b"\0",
        "2^32 - 1 chunks": put(data, 24, "<I", 2 ** 32 - 1),
        "a file of 2^64 - 1 bytes": put(data, 32, "<Q", 2 ** 64 - 1),
        "a chunk of 2^64 - 1 raw bytes": put(data, 64 + 24, "<Q", 2 ** 64 - 1),
        "a chunk at 2^64 - 1": put(data, 64 + 8, "<Q", 2 ** 64 - 1),
        "a frame of zstd that lies about its size": with_chunk(b"SMPL", lambda c: {"codec": 1, "stored": lying(c)}),
        "two frames of zstd": with_chunk(b"SMPL", lambda c: {"codec": 1, "stored": frames(c) + frames(c)[:40]}),
        "a changed byte": data[:-3] + bytes([data[-3] ^ 1]) + data[-2:],
    }
    for name, content in faults.items():
        path.write_bytes(content)
        runner.refused("container", name, 3, "verify", path, must=["["])


def rows(btfc, source, folder):
    runner = Runner(btfc, source, folder)
    for part in (sizes, not_finite, odd_sets, outputs, lies):
        part(runner)
    return runner.rows
