#!/usr/bin/env python3
"""The command against tests/reference, a reader written from the spec alone: sizes, texels, and what is refused.

reference_test.py --btfc PATH [--source DIR] [--dump PATH] [unittest arguments]

--dump names the program `btfc_dump IN.btfc MAP OUT.raw`, which writes the codes of a map through the C
interface; without it codes come from the PNGs that the command decodes to, which hold unorm8 and unorm16 unchanged.
"""

import argparse
import io
import json
import os
import random
import struct
import subprocess
import sys
import tempfile
import types
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

BTFC, SOURCE, DUMP = None, files.ROOT, None
ENCODED, MUTATIONS = 30, 340
reference = None  # the module, once --source is known


def run(*args):
    return subprocess.run([BTFC, *map(str, args)], capture_output=True, text=True)


def vectors():
    return sorted((SOURCE / "tests/vectors").glob("*/*.btfc"))


def reader_codes(data, number):
    item = reference.open_item(io.BytesIO(data))
    bands = reference.decode_region(item, number, 0, 0, item.head.width, item.head.height)
    dtype = "u1" if item.head.maps[number].bits == 8 else "<u2"
    return b"".join(band.astype(dtype).tobytes() for band in bands)


def reader_verdict(data):
    """0, 3 or 5, as `btfc verify` exits."""
    try:
        reference.check(io.BytesIO(data), None)
    except reference.Refusal as refusal:
        return (3 if refusal.kind == "invalid" else 5), refusal.rule
    return 0, None


@unittest.skipIf(MISSING, MISSING)
class ReferenceTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def command_codes(self, path, number, name, sample_type):
        """The codes of a map as the command decodes them, or None where no way is at hand."""
        if DUMP:
            out = self.folder / "codes.raw"
            subprocess.run([DUMP, path, name, out], check=True)
            return out.read_bytes()
        if sample_type == "float16":
            return None
        out = self.folder / "codes.png"
        done = run("decode", path, "-o", out, "--map", name)
        self.assertEqual(done.returncode, 0, done.stderr)
        bits, codes = files.read_png(out)[3:]
        self.assertEqual(bits, 8 if sample_type == "unorm8" else 16)
        return bytes(codes) if bits == 8 else struct.pack(f"<{len(codes)}H", *codes)

    def same_half_floats(self, path, number, name):
        """Without the dump program: `compare` finds the reader's texels, given back as an image, identical."""
        with open(path, "rb") as stream:
            head = reference.open_file(stream).head
        codes = np.frombuffer(reader_codes(path.read_bytes(), number), "<f2").astype(float).tolist()
        image = self.folder / "codes.tif"
        files.write_tiff(image, head.width, head.height, head.maps[number].channels, codes)
        done = run("compare", path, image, "--map", name)
        self.assertEqual(done.returncode, 0, f"{path} {name}: {done.stdout}{done.stderr}")

    def check_texels(self, path, maps):
        data = path.read_bytes()
        answer = reference.selftest(io.BytesIO(data), types.SimpleNamespace(count=300))
        self.assertTrue(answer["ok"], f"{path}: {answer}")
        for number, m in enumerate(maps):
            codes = self.command_codes(path, number, m["name"], m["sample_type"])
            if codes is None:
                self.same_half_floats(path, number, m["name"])
            else:
                self.assertTrue(codes == reader_codes(data, number), f"{path}: map {m['name']} decodes differently")

    def check_file(self, path):
        """Everything that reader and command say about one file; returns the command's info."""
        data = path.read_bytes()
        self.assertEqual(reader_verdict(data), (0, None), path)
        done = run("verify", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run("info", path, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said, found = json.loads(done.stdout), reference.info(io.BytesIO(data), None)

        self.assertEqual(found.pop("paper_bits"), said["paper"]["bits"], path)
        maps = found.pop("maps")
        self.assertEqual([{key: m[key] for key in maps[0]} for m in said["maps"]], maps, path)
        chunks = found.pop("chunks")
        self.assertEqual([{key: c[key] for key in chunks[0]} for c in said["chunks"]], chunks, path)
        self.assertEqual({key: said[key] for key in found}, found, path)
        self.assertEqual(said["payload_bits"], said["formula_bits"], path)
        self.assertLessEqual(said["file_bytes"], said["file_max_bytes"], path)
        self.assertEqual(said["file_bytes"], len(data), path)
        if all(c["codec"] == "raw" for c in chunks):
            self.assertEqual(said["file_bytes"], said["file_max_bytes"], path)

        self.check_texels(path, said["maps"])
        return said

    def test_vectors(self):
        self.assertGreaterEqual(len(vectors()), 14)
        for path in vectors():
            with self.subTest(path.name):
                said, expected = self.check_file(path), json.loads(path.with_suffix(".json").read_text())
                maps = expected.pop("maps")
                self.assertEqual({key: said[key] for key in expected}, expected)
                self.assertEqual(len(said["maps"]), len(maps))
                for number, (m, wanted) in enumerate(zip(said["maps"], maps)):
                    for key in ("name", "channels", "sample_type"):
                        self.assertEqual(m[key], wanted[key])
                    for codes in (reader_codes(path.read_bytes(), number),
                                  self.command_codes(path, number, m["name"], m["sample_type"])):
                        if codes is None:
                            continue
                        self.assertEqual(f"{xxhash.xxh3_64_intdigest(codes):016x}", wanted["xxh3_64"])
                        numbers = np.frombuffer(codes, "u1" if m["sample_type"] == "unorm8" else "<u2")
                        self.assertEqual(numbers.reshape(-1, m["channels"])[:4].tolist(), wanted["first_texels"])

    def test_encoded_files(self):
        rng = random.Random(20)
        sides = [2, 3, 5, 13, 17, 24, 31, 32, 47, 61, 64, 101, 256, 257]
        kinds = ["tiles", "weave", "bricks", "pebbles", "grain"]
        for number in range(ENCODED):
            sample_type = ("unorm8", "unorm16", "float16")[number % 3]
            width, height = rng.choice(sides), rng.choice(sides)
            wb = rng.randint(2, min(width, height, 48))
            we = rng.choice([1, wb // 2, rng.randint(1, max(1, wb // 2))])
            blend = [["--blend", "liang"], ["--blend", "quilting", "--pack", "rgba8"],
                     ["--blend", "quilting", "--pack", "packed"]][number // 3 % 3]
            size = (["--k", f"{rng.randint(1, 6)}x{rng.randint(1, 6)}"] if number % 2 else
                    ["--size", f"{rng.choice([1, 7, 97, 128, 211])}x{rng.choice([1, 11, 89, 128, 163])}"])
            image = self.folder / f"sample.{'exr' if sample_type == 'float16' else 'png'}"
            path = self.folder / "encoded.btfc"
            arguments = [*size, "--wb", wb, "--we", we, *blend, "--codec", rng.choice(["raw", "zstd"]), "--seed", number]
            with self.subTest(f"{number}: {sample_type} {width}x{height} {' '.join(map(str, arguments))}"):
                done = run("synth", rng.choice(kinds), "-o", image, "--size", f"{width}x{height}", "--type", sample_type,
                           "--seed", number)
                self.assertEqual(done.returncode, 0, done.stderr)
                done = run("encode", image, "-o", path, "--model", "patch", *arguments)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.check_file(path)

    def test_reader_as_a_program(self):
        path = self.folder / "program.btfc"
        good = vectors()[0].read_bytes()
        newer = files.rehash(good[:14] + b"\2\0" + good[16:])
        for data, status in ((good, 0), (good[:-1], 3), (newer, 5)):
            path.write_bytes(data)
            done = subprocess.run([sys.executable, "-B", SOURCE / "tests/reference/btfc_reference.py", "check", path],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, status, done.stdout + done.stderr)
            self.assertEqual(json.loads(done.stdout)["ok"], status == 0)
            self.assertEqual(run("verify", path).returncode, status)

    def mutated(self, data, rng):
        """One file with a fault or a harmless change, and what was done to it."""
        chunks = files.read_chunks(data)
        directory = 64 + 48 * len(chunks)
        way = rng.randrange(8)

        def flipped(what, at):
            return what[:at] + bytes([what[at] ^ 1 << rng.randrange(8)]) + what[at + 1:]

        if way == 0:
            at = rng.randrange(len(data))
            return flipped(data, at), f"byte {at}"
        if way == 1:
            at = rng.choice([rng.randrange(12, 56), rng.randrange(64, directory)])
            return files.rehash(flipped(data, at)), f"directory byte {at}, rehashed"
        if way == 2:
            at = rng.choice([12, 14, 16, 20, 24, 28, 32, 40, 48])
            value = rng.choice([0, 1, 2, 4, 5, 16, 17, 1 << 20, 0xffffffff])
            return files.rehash(data[:at] + struct.pack("<I", value) + data[at + 4:]), f"u32 at {at} = {value}, rehashed"
        if way == 3:
            size = rng.choice([rng.randrange(len(data)), len(data) - 1])
            more = rng.random() < 0.3
            return data + bytes(rng.randint(1, 64)) if more else data[:size], "appended" if more else f"cut to {size}"
        if way == 4:
            gone = rng.choice(chunks)
            rest = [c for c in chunks if c is not gone]
            extra = [files.Chunk(**{**vars(gone), rng.choice(["flags", "key_a", "tile"]): rng.randrange(9)})]
            if rng.random() < 0.5:
                return files.build_file(rest + extra), f"{gone.type} with other flags or key"
            return files.build_file(rest or chunks), f"without {gone.type}"
        if way == 5:
            kind = bytes(rng.choice(b"AZaz!~ ") for _ in range(4))
            flags = rng.choice([0, 0, 4, 4, 1, 3, 2, 8])
            chunk = files.raw_chunk(kind, flags, bytes(rng.randint(1, 40)), rng.randrange(3))
            return files.build_file(chunks + [chunk], rng.choice([16, 16, 64, 8])), f"added {kind} with flags {flags}"
        # A change inside a chunk, with its hash and the directory's made right again.
        chunk = rng.choice(chunks)
        raw = zstandard.ZstdDecompressor().decompress(chunk.stored) if chunk.codec else chunk.stored
        at = rng.randrange(len(raw))
        if chunk.type in (b"HEAD", b"PARM") and rng.random() < 0.5:
            at -= at % 4
            value = rng.choice([0, 1, 2, 3, 5, 255, 256, 257, 65536, 65537, 0x7fffffff, 0xffffffff])
            raw = raw[:at] + struct.pack("<I", value) + raw[at + 4:]
        elif way == 6 and chunk.codec:
            # The frame itself changes; its content keeps whatever hash it now has, if it has any.
            at = rng.randrange(len(chunk.stored))
            stored = flipped(chunk.stored, at)
            try:
                raw = zstandard.ZstdDecompressor().decompress(stored)
            except zstandard.ZstdError:
                pass
            changed = files.Chunk(**{**vars(chunk), "stored": stored, "raw_hash": files.hash_of(raw)})
            return files.build_file([changed if c is chunk else c for c in chunks]), f"{chunk.type} frame byte {at}"
        else:
            raw = flipped(raw, at)
        changed = files.raw_chunk(chunk.type, chunk.flags, raw, chunk.key_a)
        return files.build_file([changed if c is chunk else c for c in chunks]), f"{chunk.type} byte {at}, rehashed"

    def test_mutations(self):
        rng, path, counts, rules = random.Random(4), self.folder / "mutated.btfc", [0, 0], set()
        sources = vectors()
        for number in range(MUTATIONS):
            source = sources[number % len(sources)]
            data, what = self.mutated(source.read_bytes(), rng)
            path.write_bytes(data)
            status, rule = reader_verdict(data)
            done = run("verify", path)
            with self.subTest(f"{number}: {source.name}, {what}"):
                self.assertIn(done.returncode, (0, 3, 5), done.stderr)
                self.assertEqual(done.returncode == 0, status == 0, f"reader: {status} {rule}, command: {done.stderr}")
                if status == 0:
                    self.check_texels(path, reference.info(io.BytesIO(data), None)["maps"])
            counts[status != 0] += 1
            rules.add(rule)
        print(f"\n{MUTATIONS} mutations: {counts[0]} accepted and {counts[1]} refused by both, by rules "
              f"{' '.join(sorted(rules - {None}))}", file=sys.stderr)
        self.assertGreater(min(counts), 30)


def main():
    global BTFC, SOURCE, DUMP, reference
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--source", type=Path, default=files.ROOT)
    parser.add_argument("--dump", type=os.path.abspath)
    args, rest = parser.parse_known_args()
    BTFC, SOURCE, DUMP = str(Path(args.btfc).resolve()), args.source.resolve(), args.dump
    if not MISSING:
        sys.path.insert(0, str(SOURCE / "tests/reference"))
        import btfc_reference
        reference = btfc_reference
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
