#!/usr/bin/env python3
"""The command against tests/reference, a reader written from the spec alone: sizes, texels, and what is refused.

reference_test.py --btfc PATH [--source DIR] [--dump PATH] [unittest arguments]

--dump names the program btfc_dump, which writes codes and values through the C interface. Without it codes come from
the PNGs that the command decodes to, which hold unorm8 and unorm16 unchanged, and the values of models with directions
are not compared. These agree where they differ by 1e-5 of the file's largest value at most, and by what a file of random
fields states as its `error` beside that: the reader gives the stationary solution.
"""

import argparse
import functools
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
import btf_faults
import btf_sets as sets
import field_faults
import gm_faults
import make_vectors as files

try:
    import numpy as np
    import xxhash
    import zstandard
    MISSING = ""
except ImportError as error:
    MISSING = f"python modules are missing: {error}"

BTFC, SOURCE, DUMP = None, files.ROOT, None
ENCODED, ENCODED_SETS, MUTATIONS = 24, 21, 300
TOLERANCE = 1e-5  # of the largest value
reference = reference_tables = None  # the modules, once --source is known


def run(*args):
    return subprocess.run([BTFC, *map(str, args)], capture_output=True, text=True)


def vectors():
    return sorted((SOURCE / "tests/vectors").glob("*/*.btfc"))


def reader_codes(data, number):
    item = reference.open_item(io.BytesIO(data))
    bands = reference.decode_region(item, number, 0, 0, item.head.width, item.head.height)
    dtype = "u1" if item.head.maps[number].bits == 8 else "<u2"
    return b"".join(band.astype(dtype).tobytes() for band in bands)


def gives_values(data):
    return reference.open_file(io.BytesIO(data)).model.VALUES


def paper_bits(said):
    """Of `info`; the papers of some models print no size."""
    return said["paper"]["bits"] if "paper" in said else None


def term_size(data):
    return reference.open_item(io.BytesIO(data)).model.term_size()


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

    def setUp(self):
        self.worst = 0.0

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

    def command_values(self, path, queries, channels, *levels):
        """The values of each query as the decoder gives them, with so many levels loaded."""
        text, out = self.folder / "queries.txt", self.folder / "values.f32"
        text.write_text(sets.query_lines(queries))
        done = subprocess.run([DUMP, path, "--queries", text, out, *map(str, levels)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{path}: {done.stderr}")
        numbers, answers = iter(np.frombuffer(out.read_bytes(), "<f4").tolist()), []
        for q in queries:
            answers.append([next(numbers) for _ in range(channels[q["map"]])])
        self.assertIsNone(next(numbers, None))
        return answers

    def compare_values(self, path, queries, found, expected, most, more=()):
        """Within `most`, and for each query what stands for it in `more`."""
        worst = 0.0
        for i, (q, a, b) in enumerate(zip(queries, found, expected)):
            difference = max(abs(x - y) for x, y in zip(a, b))
            allowed = most + (more[i] if more else 0)
            self.assertLessEqual(difference, allowed, f"{path}: {q}: {a} instead of {b}")
            worst = max(worst, difference)
        return worst

    def check_values(self, path, queries=None, size=None, damaged=False):
        """The reader's two ways, and the command against them; size: what differences are measured by. A damaged
        file may hold numbers that no decoder in binary32 can be exact with."""
        data = path.read_bytes()
        answer = reference.selftest(io.BytesIO(data), types.SimpleNamespace(count=60))
        self.assertTrue(answer["ok"], f"{path}: {answer}")
        item = reference.open_item(io.BytesIO(data))
        size = size or item.model.largest()
        queries = queries or sets.queries_of(item, 60, len(data))
        expected = [reference.value(item, *(q[key] for key in ("map", "x", "y", "view", "light"))) for q in queries]
        if DUMP:
            found = self.command_values(path, queries, [m.channels for m in item.head.maps])
            more = [sets.uncertainty(item, q) for q in queries] if damaged else ()
            most = TOLERANCE * size + (0 if damaged else item.model.error)
            worst = self.compare_values(path, queries, found, expected, most, more)
            self.worst = max(self.worst, worst / size)
            self.check_rounded(path, item, damaged)
        return expected

    def check_rounded(self, path, item, damaged):
        """Whole maps along the normal: section 6's rounding, of values that may differ by a step at its borders. The size
        of an unbounded texture is a number of its own: one that damage made large is left out."""
        if damaged and item.head.unbounded and item.head.width * item.head.height > 1 << 14:
            return
        for number, m in enumerate(item.head.maps):
            dtype = "u1" if m.bits == 8 else "<u2"
            codes = np.frombuffer(self.command_codes(path, number, m.name, "float16"), dtype).astype(np.int64)
            expected = np.concatenate(list(reference.decode_region(item, number, 0, 0, item.head.width,
                                                                   item.head.height))).ravel().astype(np.int64)
            y, x = np.divmod(np.arange(item.head.width * item.head.height), item.head.width)
            values = np.abs(item.model.values(number, x, y, reference.NORMAL, reference.NORMAL)).ravel()
            more = item.model.uncertainty(number, x, y, reference.NORMAL, reference.NORMAL).repeat(m.channels)
            more = more if damaged else np.where(np.isinf(more), np.inf, item.model.error)
            steps = {8: 1, 16: 1 + 65535 * TOLERANCE * item.model.largest()}[m.bits] + more * (2 ** m.bits - 1)
            if m.sample_type == 2:
                codes, expected = (c.astype("<u2").view("<f2").astype(float) for c in (codes, expected))
                steps = np.maximum(values / 1024, TOLERANCE * item.model.largest()) + 1e-7 + more
            self.assertTrue((np.abs(codes - expected) <= steps).all(), f"{path}: map {m.name} is rounded differently")

    def check_file(self, path):
        """Everything that reader and command say about one file; returns the command's info."""
        data = path.read_bytes()
        self.assertEqual(reader_verdict(data), (0, None), path)
        done = run("verify", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run("info", path, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said, found = json.loads(done.stdout), reference.info(io.BytesIO(data), None)

        self.assertEqual(found.pop("paper_bits"), paper_bits(said), path)
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

        if gives_values(data):
            self.check_values(path)
        else:
            self.check_texels(path, said["maps"])
        return said

    def test_vectors(self):
        self.assertGreaterEqual(len(vectors()), 14)
        for path in vectors():
            with self.subTest(path.name):
                said, expected = self.check_file(path), json.loads(path.with_suffix(".json").read_text())
                maps, queries = expected.pop("maps"), expected.pop("queries", None)
                largest, paper = expected.pop("largest", None), expected.pop("paper_bits", paper_bits(said))
                self.assertEqual(paper_bits(said), paper)
                self.assertEqual({key: said[key] for key in expected}, expected)
                self.assertEqual(len(said["maps"]), len(maps))
                for number, (m, wanted) in enumerate(zip(said["maps"], maps)):
                    for key in ("name", "channels", "sample_type"):
                        self.assertEqual(m[key], wanted[key])
                    if queries:
                        continue
                    for codes in (reader_codes(path.read_bytes(), number),
                                  self.command_codes(path, number, m["name"], m["sample_type"])):
                        if codes is None:
                            continue
                        self.assertEqual(f"{xxhash.xxh3_64_intdigest(codes):016x}", wanted["xxh3_64"])
                        numbers = np.frombuffer(codes, "u1" if m["sample_type"] == "unorm8" else "<u2")
                        self.assertEqual(numbers.reshape(-1, m["channels"])[:4].tolist(), wanted["first_texels"])
                if queries:
                    found = self.check_values(path, queries, largest)
                    self.compare_values(path, queries, found, [q["values"] for q in queries], 1e-9 * largest)
        print(f"\nvalues of vectors differ by {self.worst:.1e} of the largest at most", file=sys.stderr)

    def test_levels_of_fields(self):
        """Files loaded in part: what is left out is smoothed away (car.md 5.4 and 5.5)."""
        if not DUMP:
            self.skipTest("no --dump")
        for path in (p for p in vectors() if p.parent.name in files.FIELDS):
            item = reference.open_item(io.BytesIO(path.read_bytes()))
            queries, model = sets.queries_of(item, 20), item.model
            for levels in range(1, model.P + 1):
                with self.subTest(f"{path}: {levels} of {model.P} levels"):
                    model.finest = model.P - levels
                    expected = [reference.value(item, *(q[key] for key in ("map", "x", "y", "view", "light"))) for q in queries]
                    found = self.command_values(path, queries, [m.channels for m in item.head.maps], levels)
                    self.compare_values(path, queries, found, expected, TOLERANCE * model.largest() + model.error)

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

    def mixture_arguments(self, rng):
        """Options of gm; the fits are short."""
        components = rng.randint(1, 40)
        arguments = ["--components", components, "--gates", rng.choice([0, 0, 1, 4, 32]), "--transform",
                     rng.choice(["identity", "log"])]
        if rng.random() < 0.3:
            return arguments + ["--layout", "paper", "--fit", "em", "--iterations", 6, "--mean-brdf",
                                rng.choice(["f32", "u8"])]
        mean = rng.choice(["f32", "u8", "coded"])
        rank = ["--mean-rank", rng.randint(1, 5)] if mean == "coded" else []
        fit = rng.choice([["--fit", "em", "--iterations", 6, "--shear", "off"],
                          ["--fit", "refined", "--iterations", 150, "--shear", rng.choice(["on", "off"])]])
        return arguments + ["--levels", rng.randint(1, components.bit_length()), "--precision",
                            rng.choice(["f32", "f16", "u8"]), "--mean-brdf", mean, *rank, *fit]

    def field_arguments(self, rng, size, pairs):
        """Options of car, gmrf and car3d. Recursions of coarse errors die away fast."""
        relief = [f"{rng.randint(1, size[0])}x{rng.randint(1, size[1])}", "--range-bits", rng.choice([8, 16])]
        return ["--clusters", rng.randint(1, min(pairs, 6)), "--levels", rng.randint(1, 2), "--order", rng.choice([0, 1, 2, 4]),
                "--knots", rng.choice([0, 2, 16]), "--error", 0.05, "--precision", rng.choice(["f32", "f16"]),
                "--seed", rng.randrange(1 << 32), "--range", *(relief if rng.random() < 0.5 else ["0"])]

    def test_encoded_sets(self):
        """The models of BTFs: random directions, sizes, ranks, precisions and pairs."""
        rng = random.Random(30)
        grids = [sets.RING, sets.GRID, sets.LINE, sets.SIDE, sets.HORIZON]
        for number in range(ENCODED_SETS):
            model = ("pcarf", "pca", "lpca", "gm", "car", "gmrf", "car3d")[number % 7]
            is_field = model in files.FIELDS

            def directions():
                grid = rng.choice(grids)
                some = rng.sample(grid, rng.randint(1, len(grid)))
                if rng.random() < 0.5:
                    some = sorted({(rng.randint(1, 90), rng.randrange(360)) for _ in range(rng.randint(1, 12))})
                return some if sets.least_height(some, reference_tables) > 2 ** -5 else directions()

            views, lights = directions(), directions()
            channels = rng.choice([1, 3, 3, 4 if model == "gm" else 5])
            sample_type = "float16" if channels == 5 else rng.choice(["unorm8", "unorm16", "float16"])
            size = tuple(rng.randint(9, 30) if is_field else rng.randint(1, 9) for _ in range(2))
            pairs = [(a, b) for a in range(len(views)) for b in range(len(lights))]
            missing = set(rng.sample(pairs, len(pairs) // 3)) if rng.random() < 0.5 else set()
            # Each view and each light stays in a pair.
            missing -= {(a, a % len(lights)) for a in range(len(views))} | {(b % len(views), b)
                                                                          for b in range(len(lights))}
            arguments = ["--codec", rng.choice(["raw", "zstd"])]
            if model == "gm":
                arguments += self.mixture_arguments(rng)
            elif is_field:
                arguments += self.field_arguments(rng, size, len(pairs) - len(missing))
            else:
                most = min(6, size[0] * size[1], len(pairs) - len(missing))
                rank = rng.randint(0, most if model != "pcarf" else min(most, len(lights)))
                arguments += ["--rank", rank, "--precision", rng.choice(["f32", "f16", "u8"]), "--table-precision",
                              rng.choice(["f32", "f16", "u8"])]
            if model == "lpca":
                arguments += ["--clusters", rng.choice([1, 2, size[0] * size[1]])]
            with self.subTest(f"{number}: {model} {size} {channels} {sample_type} {len(views)}x{len(lights)} views and "
                              f"lights less {len(missing)}, {' '.join(map(str, arguments))}"):
                described = sets.write_set(self.folder / f"set{number}", views, lights, size, channels, sample_type,
                                           rng.random() < 0.5, missing, number)
                path = self.folder / "set.btfc"
                done = run("encode", described, "-o", path, "--model", model, *arguments)
                self.assertEqual(done.returncode, 0, done.stderr)
                said = self.check_file(path)
                self.assertEqual((said["views"], said["lights"], said["pairs"]),
                                 (len(views), len(lights), len(pairs) - len(missing)))
        print(f"\nvalues of encoded sets differ by {self.worst:.1e} of the largest at most", file=sys.stderr)

    def test_worked_example_of_gm(self):
        """Section 5 of the page, and both of the reader's ways under footprints, which queries of files have not."""
        sources = {p.stem: p.read_bytes() for p in vectors() if p.parent.name == "gm"}
        chunks = files.read_chunks(sources["rgb8_f32"])
        head = reference.open_file(io.BytesIO(sources["rgb8_f32"])).head
        # The query is the texel (4, 1) along the normal: 2 and 6 texels from the components in x.
        rows = [[2.5, 10.5], [1.5, 1.5], *[[0, 0]] * 4, *[[2, 2]] * 2, *[[0, 0]] * 4, [-3, -3], [1, 0], [0, 1], [0, 0]]
        numbers = [number for row in rows for number in row]
        made = [c for c in chunks if c.type in (b"HEAD", b"DIRS")]
        for kind, raw in ((b"PARM", struct.pack("<IH6B2H", 2, 0, 1, 0, 0, 0, 0, 0, 0, 0)),
                          (b"MEAN", bytes(4 * head.pairs * head.channels)),
                          (b"GMIX", struct.pack(f"<{len(numbers)}f", *numbers))):
            made.append(files.raw_chunk(kind, files.CRITICAL | files.PAYLOAD, raw))
        path = self.folder / "worked.btfc"
        path.write_bytes(files.build_file(made))
        self.check_file(path)
        item, along = reference.open_item(io.BytesIO(path.read_bytes())), reference.NORMAL
        kept = 1 / 1.328125  # of a peak under the footprint
        for footprint, weight, far in ((1, 0.73106, 0), (8, 0.67982, 0.5)):
            for found in (item.model.value(0, 4, 1, along, along, footprint),
                          item.model.values(0, 4, 1, along, along, footprint)):
                for value, wanted in zip(found, (weight, 1 - weight, 0)):
                    self.assertAlmostEqual(value, wanted and wanted - (1 - kept) * far, 5)

        for name, data in sources.items():
            item = reference.open_item(io.BytesIO(data))
            largest = item.model.largest()
            for q in sets.queries_of(item, 20):
                x, y = (int(at) for at in reference.place(item.head, q["x"], q["y"]))
                for footprint in (0, 1.5, 7, 1e9):
                    a, b = (way(q["map"], x, y, q["view"], q["light"], footprint)
                            for way in (item.model.value, item.model.values))
                    self.assertLess(max(abs(np.array(a) - b)), 1e-9 * largest, f"{name}: {q}, footprint {footprint}")

    def test_values_as_a_program(self):
        path = self.folder / "program.btfc"
        source = next(p for p in vectors() if p.parent.name == "pca")
        path.write_bytes(source.read_bytes())
        expected = json.loads(source.with_suffix(".json").read_text())["queries"]
        queries, out = self.folder / "queries.json", self.folder / "values.f64"
        queries.write_text(json.dumps(expected))
        reader = SOURCE / "tests/reference/btfc_reference.py"
        subprocess.run([sys.executable, "-B", reader, "values", path, queries, "-o", out], check=True)
        found = np.frombuffer(out.read_bytes(), "<f8")
        wanted = np.array([v for q in expected for v in q["values"]])
        self.assertLess(np.abs(found - wanted).max(), 1e-9 * np.abs(wanted).max())

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
        values = gives_values(data)
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
            extra = [files.Chunk(**{**vars(gone), rng.choice(["flags", "key_a", "tile"]): rng.choice(
                [rng.randrange(9), rng.randrange(9) << 8] if values else [rng.randrange(9)])})]
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
        changed.tile = chunk.tile
        return files.build_file([changed if c is chunk else c for c in chunks]), f"{chunk.type} byte {at}, rehashed"

    def test_faults(self):
        """Reader and command name the rule that a file breaks; the conformance page lists each case."""
        path, page = self.folder / "fault.btfc", (SOURCE / "spec/conformance.md").read_text()
        makers = {model: functools.partial(btf_faults.faults, model) for model in btf_faults.LETTERS}
        makers.update({model: functools.partial(field_faults.faults, model) for model in files.FIELDS})
        for model, make in {**makers, "gm": gm_faults.faults}.items():
            of_model = {p.stem: p.read_bytes() for p in vectors() if p.parent.name == model}
            for rule, name, data in make(of_model, lambda d: reference.open_file(io.BytesIO(d))):
                with self.subTest(f"{model}: {rule} {name}"):
                    # A size that is not demanded is found in the index, before the chunk is read.
                    rules = ("V2", "D12") if rule == "V2" else (rule,)
                    status, found = reader_verdict(data)
                    self.assertEqual((status, found in rules), (3, True), f"reader: {found}")
                    path.write_bytes(data)
                    done = run("verify", path, "--json")
                    self.assertEqual(done.returncode, 3, done.stderr)
                    self.assertIn(json.loads(done.stdout)["rule"], rules, done.stdout)
                    self.assertIn(f"| {rule} | {name} |", page)

    def check_mutated_values(self, path, what):
        """Moved directions may lie almost on a line or a circle, where rounding decides (tables.md 4)."""
        data = path.read_bytes()
        if "DIRS" in what:
            item = reference.open_item(io.BytesIO(data))
            if DUMP:
                self.command_values(path, sets.queries_of(item), [m.channels for m in item.head.maps])
            return
        self.check_values(path, size=term_size(data), damaged=True)

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
                if status == 0 and gives_values(data):
                    self.check_mutated_values(path, what)
                elif status == 0:
                    self.check_texels(path, reference.info(io.BytesIO(data), None)["maps"])
            counts[status != 0] += 1
            rules.add(rule)
        print(f"\n{MUTATIONS} mutations: {counts[0]} accepted and {counts[1]} refused by both, by rules "
              f"{' '.join(sorted(rules - {None}))}", file=sys.stderr)
        self.assertGreater(min(counts), 30)


def main():
    global BTFC, SOURCE, DUMP, reference, reference_tables
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--source", type=Path, default=files.ROOT)
    parser.add_argument("--dump", type=os.path.abspath)
    args, rest = parser.parse_known_args()
    BTFC, SOURCE, DUMP = str(Path(args.btfc).resolve()), args.source.resolve(), args.dump
    if not MISSING:
        sys.path.insert(0, str(SOURCE / "tests/reference"))
        import btfc_reference
        import btfc_tables
        reference, reference_tables = btfc_reference, btfc_tables
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
