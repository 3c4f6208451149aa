#!/usr/bin/env python3
"""Real pictures through the command: a 128x128 sample from the middle of each becomes a texture of 1024x1024.

data_test.py --btfc PATH [--source DIR] [--quick] [--table FILE] [unittest arguments]

The pictures are looked for in $BTFC_DATA or beside the sources in ../shared/data. Encoder, decoder, `verify` and the
reference reader must agree on every texel; sizes and rates are printed, as Markdown also to --table, and never judged.
"""

import argparse
import io
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
import make_vectors as files

try:
    import numpy as np
    import xxhash
    import zstandard
    MISSING = ""
except ImportError as error:
    MISSING = f"python modules are missing: {error}"

BTFC, SOURCE, QUICK, TABLE = None, files.ROOT, False, None
reference = None  # the module, once --source is known
SAMPLE, SIDE = 128, 1024
PICTURES = ["textures_ambientcg/*/albedo.jpg", "textures_godot/*_albedo.*", "textures_godot/texture_wood.png",
            "textures_godot/texture_bricks.jpg", "textures_polyhaven/*/*_diff_*", "textures_skimage/brick.png",
            "textures_skimage/grass.png", "textures_skimage/gravel.png", "hdr/*.exr"]
QUICK_PICTURES = ["textures_ambientcg/bark/albedo.jpg", "textures_godot/texture_bricks.jpg",
                  "textures_skimage/gravel.png", "hdr/Rec709.exr"]
COLUMNS = ["picture", "blend", "bit/texel by formula", "bit/texel as a file", "encode s", "full Mtexel/s",
           "random Mtexel/s"]


def data_folder():
    return Path(os.environ.get("BTFC_DATA", SOURCE / "../shared/data"))


def size_of(path):
    """Width and height of a PNG, JPEG or EXR."""
    data = path.read_bytes()
    if data[:4] == b"\x89PNG":
        return struct.unpack_from(">2I", data, 16)
    if data[:2] == b"\xff\xd8":
        at = 2
        while True:
            marker, length = struct.unpack_from(">2H", data, at)
            if marker in (0xffc0, 0xffc1, 0xffc2):
                return struct.unpack_from(">2H", data, at + 5)[::-1]
            at += 2 + length
    name = b"dataWindow\0box2i\0"
    left, top, right, bottom = struct.unpack_from("<4i", data, data.index(name) + len(name) + 4)
    return right - left + 1, bottom - top + 1


def markdown(rows):
    lines = ["| " + " | ".join(COLUMNS) + " |", "|---|---" + "|---:" * (len(COLUMNS) - 2) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


class DataTest(unittest.TestCase):
    def run_ok(self, *args):
        done = subprocess.run([BTFC, *map(str, args)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{args}: {done.stdout}{done.stderr}")
        return done.stdout

    def pictures(self):
        folder = data_folder()
        if not folder.is_dir():
            self.skipTest(f"no pictures: {folder} does not exist, set BTFC_DATA")
        found = sorted({path for pattern in (QUICK_PICTURES if QUICK else PICTURES) for path in folder.glob(pattern)})
        if not found:
            self.skipTest(f"no pictures in {folder}")
        return folder, found

    @unittest.skipIf(MISSING, MISSING)
    def test_pictures(self):
        data, found = self.pictures()
        rows = []
        with tempfile.TemporaryDirectory() as folder:
            for path in found:
                for blend in ("liang", "quilting"):
                    with self.subTest(f"{path.relative_to(data)} {blend}"):
                        rows.append([str(path.relative_to(data)), blend, *self.round_trip(path, blend, Path(folder))])
        print("\n" + markdown(rows), file=sys.stderr)
        if TABLE:
            Path(TABLE).write_text(markdown(rows))

    def round_trip(self, picture, blend, folder):
        width, height = size_of(picture)
        self.assertGreaterEqual(min(width, height), SAMPLE)
        floats = picture.suffix == ".exr"
        texture, extension = folder / "texture.btfc", ".exr" if floats else ".png"
        held, decoded, read = (folder / (name + extension) for name in ("held", "decoded", "read"))
        window = f"{(width - SAMPLE) // 2},{(height - SAMPLE) // 2},{SAMPLE},{SAMPLE}"
        said = json.loads(self.run_ok("encode", picture, "-o", texture, "--model", "patch", "--sample", window, "--size",
                                      f"{SIDE}x{SIDE}", "--blend", blend, "--synthesized", held, "--json"))
        self.assertEqual((said["width"], said["height"]), (SIDE, SIDE))
        self.assertEqual(said["payload_bits"], said["formula_bits"])
        self.run_ok("verify", texture)
        self.run_ok("decode", texture, "-o", decoded)
        self.run_ok("compare", held, decoded)
        self.run_ok("compare", texture, held)

        stream = io.BytesIO(texture.read_bytes())
        self.assertTrue(reference.check(stream, None)["ok"])
        item = reference.open_item(stream)
        m = item.head.maps[0]
        codes = np.concatenate(list(reference.decode_region(item, 0, 0, 0, SIDE, SIDE))).reshape(-1)
        # The reader's texels as an image, for `compare`.
        if floats:
            read = read.with_suffix(".tif")
            files.write_tiff(read, SIDE, SIDE, m.channels, codes.astype("<u2").view("<f2").astype("<f4").tolist())
        else:
            files.write_png(read, SIDE, SIDE, m.channels, m.bits, codes.astype("u1" if m.bits == 8 else ">u2").tobytes())
        self.run_ok("compare", texture, read)

        rates = json.loads(self.run_ok("bench", texture, "--seconds", "0.1", "--json"))
        return (f"{said['bits_per_texel']:.4f}", f"{said['bits_per_texel_file']:.4f}", f"{said['seconds']:.2f}",
                f"{rates['cpu_full_mtexel_s']:.0f}", f"{rates['cpu_random_mtexel_s']:.1f}")


def main():
    global BTFC, SOURCE, QUICK, TABLE, reference
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--source", type=Path, default=files.ROOT)
    parser.add_argument("--quick", action="store_true", help="four pictures only")
    parser.add_argument("--table", help="write the table as Markdown")
    args, rest = parser.parse_known_args()
    BTFC, SOURCE, QUICK, TABLE = str(Path(args.btfc).resolve()), args.source.resolve(), args.quick, args.table
    if not MISSING:
        sys.path.insert(0, str(SOURCE / "tests/reference"))
        import btfc_reference
        reference = btfc_reference
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
