#!/usr/bin/env python3
"""The command as a user meets it: exit codes, messages, JSON, and what lies on the disk afterwards.

cli_test.py --btfc PATH [--source DIR] [unittest arguments]
"""

import argparse
import json
import math
import os
import struct
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree
from pathlib import Path

sys.dont_write_bytecode = True
import btf_sets
import make_vectors as files

try:
    import xxhash
except ImportError:
    xxhash = None

BTFC, SOURCE = None, files.ROOT
USAGE, IO, INVALID, FAILED, UNSUPPORTED, DIFFERENT = 1, 2, 3, 4, 5, 7
NOBODY = 65534
HEIGHT = 8000  # of the widest texture that is encoded

SIZE_KEYS = {"model", "format_version", "width", "height", "channels", "views", "lights", "pairs", "payload_bits",
             "formula_bits", "memory_bits", "raw_bytes_u8", "bits_per_texel", "bits_per_sample", "ratio_u8",
             "ratio_u16", "unbounded", "paper", "parameters"}
INFO_KEYS = SIZE_KEYS | {"file_bytes", "header_bytes", "index_bytes", "padding_bytes", "stored_bytes"}
COMPARE_KEYS = {"psnr_db", "rmse_8bit", "ssim", "peak_8bit", "gradient_kept", "spectrum_distance", "seam_ratio"}
BENCH_KEYS = {"cpu_full_mtexel_s", "cpu_random_mtexel_s", "cpu_batch_mtexel_s", "cpu_naive_mtexel_s",
              "memcpy_mtexel_s", "raw_random_mtexel_s", "threads"}
ENCODE_KEYS = {"output", "model", "width", "height", "file_bytes", "payload_bits", "formula_bits", "bits_per_texel",
               "seconds"}


def run(*args, **more):
    return subprocess.run([BTFC, *map(str, args)], capture_output=True, text=True, **more)


def peak_of(*args):
    """(exit code, peak resident bytes, seconds) of the command, measured by a process that has no other child."""
    script = ("import resource, subprocess, sys\n"
              "done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL)\n"
              "print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
    begin = time.monotonic()
    done = subprocess.run([sys.executable, "-c", script, BTFC, *map(str, args)], capture_output=True, text=True)
    status, peak = map(int, done.stdout.split())
    return status, 1024 * peak, time.monotonic() - begin


class CommandTest(unittest.TestCase):
    """A folder with a sample, an encoded file and what is wrong with other files."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.image, cls.grey, cls.file = (str(cls.folder / name) for name in ("image.png", "grey.png", "file.btfc"))
        for args in (["synth", "bricks", "-o", cls.image, "--size", "32x32"],
                     ["encode", cls.image, "-o", cls.file, "--model", "patch", "--k", "4", "--wb", "12", "--we", "4"]):
            done = run(*args)
            assert done.returncode == 0, done.stderr
        files.write_png(cls.grey, 16, 16, 1, 8, files.noise(256, 8, 1))
        data = Path(cls.file).read_bytes()
        for name, content in (("text.btfc", b"This is no texture.\n" * 20), ("short.btfc", b"text\n"),
                              ("cut.btfc", data[:-1]), ("empty.btfc", b""),
                              ("damaged.btfc", data[:400] + bytes([data[400] ^ 1]) + data[401:])):
            (cls.folder / name).write_bytes(content)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def setUp(self):
        for name in ("out.btfc", "out.png"):
            Path(self.path(name)).unlink(missing_ok=True)

    def path(self, name):
        return str(self.folder / name)

    def ok(self, *args):
        done = run(*args)
        self.assertEqual(done.returncode, 0, f"{args}: {done.stderr}")
        self.assertEqual(done.stderr, "", args)
        return done.stdout

    def json(self, *args):
        return json.loads(self.ok(*args))

    def fails(self, status, *args, says=(), **more):
        """The command ends with the status, says one line on standard error and nothing on standard output."""
        done = run(*args, **more)
        with self.subTest(" ".join(map(str, args))):
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, r"\Abtfc[^\n]{10,}\n\Z")
            for text in [says] if isinstance(says, str) else says:
                self.assertIn(text, done.stderr)
        return done.stderr

    def encode(self, name, *args, image=None):
        out = self.path(name)
        inputs = [] if image == () else [image or self.image]
        self.ok("encode", *inputs, "-o", out, "--model", "patch", *args)
        return out


class ExitCodeTest(CommandTest):
    def test_help(self):
        text = self.ok("help")
        for verb in ("encode", "decode", "info", "verify", "size", "compare", "synth", "bench", "copy", "tradeoff", "models"):
            self.assertIn(verb, text)
            self.assertIn("--help", self.ok("help", verb))
            self.assertIn("--help", self.ok(verb, "--help"))
        self.assertIn("Exit codes", text)
        self.assertIn("0.1", self.ok("--version"))

    def test_usage(self):
        out, png = self.path("out.btfc"), self.path("out.png")
        encode = ["encode", self.image, "-o", out, "--model", "patch"]
        size = ["size", "--model", "patch"]
        self.fails(USAGE)
        self.fails(USAGE, "frobnicate", says="frobnicate")
        self.fails(USAGE, "help", "frobnicate", says="frobnicate")
        self.fails(USAGE, "--frobnicate")

        for verb in ("encode", "decode", "info", "verify", "size", "compare", "synth", "bench", "copy"):
            self.fails(USAGE, verb)
        for verb, *rest in (encode + ["--k", "2"], ["decode", self.file, "-o", png], ["info", self.file],
                            ["verify", self.file], size + ["--sample", "8x8", "--k", "2"],
                            ["compare", self.image, self.image], ["synth", "bricks", "-o", png],
                            ["bench", self.file, "--seconds", "0.01"], ["copy", self.file, "-o", out], ["models"]):
            self.fails(USAGE, verb, *rest, "--frobnicate", says="--frobnicate")
            if verb not in ("encode", "models"):
                self.fails(USAGE, verb, *rest, "extra", says="extra")
        self.fails(USAGE, "models", "extra", says="extra")

        self.fails(USAGE, "encode", self.image, "-o", out, "--k", "2", says="--model")
        self.fails(USAGE, "encode", self.image, "--model", "patch", "--k", "2", says="--output")
        self.fails(USAGE, "encode", "-o", out, "--model", "patch", "--k", "2", says="INPUT")
        self.fails(USAGE, "encode", self.image, self.image, "-o", out, "--model", "patch", "--k", "2", says="--map")
        self.fails(USAGE, *encode, says=("--k", "--size"))
        self.fails(USAGE, "encode", self.image, "-o", out, "--model", "fractal", "--k", "2", says="fractal")
        self.fails(USAGE, *size[:1], "--model", "fractal", says="fractal")
        self.fails(USAGE, *size, says="--sample")

        for option, value in (("--k", "abc"), ("--k", "0"), ("--k", "2x"), ("--k", "65537"), ("--k", "2x3x4"),
                              ("--size", "0x8"), ("--size", "8"), ("--size", "70000x8"), ("--size", "-8x8")):
            self.fails(USAGE, *encode, option, value, says=option)
        for option, value in (("--wb", "1"), ("--wb", "4.5"), ("--wb", ""), ("--we", "-1"), ("--tau", "nan"),
                              ("--tau", "-0.1"), ("--tau", "much"), ("--blend", "glue"), ("--pack", "zip"),
                              ("--level", "23"), ("--level", "0"), ("--seed", "one"), ("--seed", "-1"),
                              ("--seed", "18446744073709551616"), ("--threads", "0"), ("--threads", "-1"),
                              ("--codec", "gzip"), ("--colour-space", "pink"), ("--sample", "0,0,8"),
                              ("--sample", "0,0,0,8"), ("--sample", "30,30,8,8"), ("--map", "x"), ("--map", "=x"),
                              ("--map", "a b=x"), ("--map", "a" * 25 + "=x")):
            self.fails(USAGE, *encode, "--k", "2", option, value, says=option)
        self.fails(USAGE, *encode, "--k", "2", "--map", f"image={self.image}", says="image")
        for option, value in (("--region", "0,0,0,1"), ("--region", "1,2,3"), ("--region", "-1,0,2,2"),
                              ("--region", "0,0,1,65536"), ("--region", "4294967295,0,1,1"), ("--map", "nope")):
            self.fails(USAGE, "decode", self.file, "-o", png, option, value, says=value)
        self.fails(USAGE, "decode", self.file, "-o", self.path("out.jpg"), says=(".png", ".exr"))
        self.fails(USAGE, "synth", "bricks", "-o", self.path("out.jpg"), says=(".png", ".exr"))
        self.fails(USAGE, "synth", "plaid", "-o", png, says="plaid")
        for option, value in (("--size", "0x1"), ("--size", "8"), ("--type", "u8"), ("--seed", "x")):
            self.fails(USAGE, "synth", "bricks", "-o", png, option, value, says=option)
        for option, value in (("--seconds", "0"), ("--seconds", "x"), ("--map", "nope")):
            self.fails(USAGE, "bench", self.file, option, value, says=value)
        for option, value in (("--align", "17"), ("--align", "8"), ("--align", "131072"), ("--align", "x"),
                              ("--align", "0x30"), ("--codec", "gzip"), ("--level", "99")):
            self.fails(USAGE, "copy", self.file, "-o", out, option, value, says=option)
        self.assertFalse(Path(out).exists() or Path(png).exists())

    def test_options_of_others(self):
        """An option that does not apply is an error, not a hint."""
        out = self.path("out.btfc")
        encode = ["encode", self.image, "-o", out, "--model", "patch", "--k", "2"]
        self.fails(USAGE, *encode, "--bits", "8", says="--bits")
        self.fails(USAGE, *encode, "--blend", "liang", "--pack", "packed", says="--pack")
        self.fails(USAGE, *encode, "--codec", "raw", "--level", "3", says="--level")
        self.fails(USAGE, "copy", self.file, "-o", out, "--codec", "raw", "--level", "3", says="--level")
        self.fails(USAGE, "size", "--model", "patch", "--sample", "64x64", "--k", "2", "--tau", "1", says="--tau")
        self.fails(USAGE, "compare", self.image, self.image, "--map", "image", says="--map")

    def test_input_output(self):
        missing, out, png = self.path("missing"), self.path("out.btfc"), self.path("out.png")
        beyond = self.path("no/such/folder")
        for verb in ("info", "verify", "bench"):
            self.fails(IO, verb, missing, says=missing)
            self.fails(IO, verb, self.folder, says=str(self.folder))
        self.fails(IO, "decode", missing, "-o", png, says=missing)
        self.fails(IO, "copy", missing, "-o", out, says=missing)
        self.fails(IO, "encode", missing, "-o", out, "--model", "patch", "--k", "2", says=missing)
        self.fails(IO, "encode", self.folder, "-o", out, "--model", "patch", "--k", "2", says=str(self.folder))
        self.fails(IO, "compare", self.image, missing, says=missing)
        self.fails(IO, "compare", missing + ".btfc", self.image, says=missing)

        folder_png, folder_btfc = self.folder / "folder.png", self.folder / "folder.btfc"
        folder_png.mkdir()
        folder_btfc.mkdir()
        for image, texture in ((f"{beyond}/x.png", f"{beyond}/x.btfc"), (folder_png, folder_btfc)):
            self.fails(IO, "decode", self.file, "-o", image, says=str(image))
            self.fails(IO, "synth", "bricks", "-o", image, "--size", "8x8", says=str(image))
            self.fails(IO, "encode", self.image, "-o", texture, "--model", "patch", "--k", "2", says=str(texture))
            self.fails(IO, "encode", self.image, "-o", out, "--model", "patch", "--k", "2", "--synthesized", image,
                       says=str(image))
            self.fails(IO, "copy", self.file, "-o", texture, says=str(texture))
        self.assertFalse(Path(out).exists())
        # No --json here: the text has gone to standard output before the file fails.
        done = run("info", self.file, "--json", f"{beyond}/x.json")
        self.assertEqual(done.returncode, IO)
        self.assertIn(beyond, done.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.startswith(".")], [])

    def test_unwritable_folder(self):
        closed = self.folder / "closed"
        closed.mkdir(mode=0o755)
        copy = closed / "in.btfc"
        copy.write_bytes(Path(self.file).read_bytes())
        more = {}
        if os.geteuid() == 0:
            more = {"user": NOBODY, "group": NOBODY}
            os.chmod(self.folder, 0o755)
            try:
                works = run("--version", **more).returncode == 0
            except OSError:
                works = False
            if not works:
                self.skipTest("runs as root, and another user may not execute the command")
        os.chmod(closed, 0o555)
        try:
            self.fails(IO, "copy", copy, "-o", closed / "out.btfc", says="out.btfc", **more)
            self.fails(IO, "decode", copy, "-o", closed / "out.png", says="out.png", **more)
            self.assertEqual(os.listdir(closed), ["in.btfc"])
        finally:
            os.chmod(closed, 0o755)

    def test_full_disk_on_standard_output(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("there is no /dev/full")
        for args in (["info", self.file, "--json"], ["verify", self.file], ["models"], ["help"]):
            with self.subTest(" ".join(args)), open("/dev/full", "w") as full:
                done = subprocess.run([BTFC, *args], stdout=full, stderr=subprocess.PIPE, text=True)
                self.assertEqual(done.returncode, IO, done.stderr)

    def test_invalid(self):
        out, png = self.path("out.btfc"), self.path("out.png")
        for name in ("text.btfc", "short.btfc", "empty.btfc", "cut.btfc", "damaged.btfc"):
            path = self.path(name)
            self.fails(INVALID, "verify", path, says=(path, "["))
            self.fails(INVALID, "info", path, says=(path, "["))
            self.fails(INVALID, "bench", path, "--seconds", "0.01", says=path)
            self.fails(INVALID, "decode", path, "-o", png, says=(path, "["))
            self.fails(INVALID, "compare", path, self.image, says=path)
            self.fails(INVALID, "copy", path, "-o", out, says=(path, "["))
        self.assertFalse(Path(out).exists() or Path(png).exists())

    def test_images_that_are_none(self):
        out = self.path("out.btfc")
        data = Path(self.image).read_bytes()
        for name, content in (("text.png", b"no image\n"), ("cut.png", data[:len(data) // 2]), ("empty.png", b"")):
            path = self.path(name)
            Path(path).write_bytes(content)
            for args in (["encode", path, "-o", out, "--model", "patch", "--k", "2"], ["compare", path, self.image]):
                done = run(*args)
                with self.subTest(f"{args[0]} {name}"):
                    self.assertIn(done.returncode, (IO, INVALID))
                    self.assertEqual(done.stdout, "")
                    # The PNG library adds a line of its own before the command can speak.
                    lines = [line for line in done.stderr.splitlines() if not line.startswith("libpng ")]
                    self.assertEqual(len(lines), 1, done.stderr)
                    self.assertIn(path, lines[0])
        self.assertFalse(Path(out).exists())

    def test_not_finite(self):
        path, out = self.path("nan.tif"), self.path("out.btfc")
        values = [0.5] * (8 * 6 * 3)
        for x, y, channel, value in ((3, 2, 1, math.nan), (5, 4, 0, math.inf), (7, 5, 2, -math.inf)):
            values[(y * 8 + x) * 3 + channel] = value
        files.write_tiff(path, 8, 6, 3, values)
        text = self.fails(INVALID, "encode", path, "-o", out, "--model", "patch", "--k", "2",
                          says=(path, "3 samples", "(3, 2)", "channel 1", "nan"))
        self.assertNotIn("\n", text[:-1])
        files.write_tiff(path, 8, 6, 3, [0.5] * 100 + [65520.0] + [0.5] * 43)
        self.fails(INVALID, "encode", path, "-o", out, "--model", "patch", "--k", "2",
                   says=(path, "1 samples", "(1, 4)", "channel 1"))
        files.write_tiff(path, 8, 6, 3, [65504.0, -65504.0, -0.0] * 48)
        self.ok("encode", path, "-o", out, "--model", "patch", "--k", "2")
        os.unlink(out)

    @unittest.skipIf(xxhash is None, "python module xxhash is missing")
    def test_unsupported(self):
        out, png = self.path("out.btfc"), self.path("out.png")
        data = Path(self.file).read_bytes()
        chunks = files.read_chunks(data)
        self.assertEqual(files.build_file(chunks), data)
        unknown = files.build_file(chunks + [files.raw_chunk(b"XTRA", files.CRITICAL, b"what is this?")])
        newer = files.build_file(chunks, minor=2)
        for name, content, says in (("unknown.btfc", unknown, "XTRA"), ("newer.btfc", newer, "0.2")):
            path = self.path(name)
            Path(path).write_bytes(content)
            self.fails(UNSUPPORTED, "verify", path, says=(path, says))
            self.fails(UNSUPPORTED, "info", path, says=(path, says))
            self.fails(UNSUPPORTED, "decode", path, "-o", png, says=(path, says))
            self.fails(UNSUPPORTED, "bench", path, says=(path, says))
            self.fails(UNSUPPORTED, "copy", path, "-o", out, says=(path, says))
        self.assertFalse(Path(out).exists() or Path(png).exists())

    def test_difference(self):
        other = self.path("other.png")
        width, height, channels, bits, codes = files.read_png(self.image)
        codes[100] ^= 1
        files.write_png(other, width, height, channels, bits, codes)
        done = run("compare", self.image, other, "--json")
        self.assertEqual((done.returncode, done.stderr), (DIFFERENT, ""))
        said = json.loads(done.stdout)
        self.assertEqual((said["differing_samples"], said["samples"], said["identical"]), (1, len(codes), False))
        self.assertAlmostEqual(said["peak_8bit"], 1, places=4)
        self.assertAlmostEqual(said["rmse_8bit"], math.sqrt(1 / len(codes)), places=5)
        self.assertAlmostEqual(said["psnr_db"], 20 * math.log10(255 * math.sqrt(len(codes))), places=3)
        self.assertEqual(run("compare", self.image, other).returncode, DIFFERENT)

        decoded = self.path("decoded.png")
        self.ok("decode", self.file, "-o", decoded)
        self.ok("compare", self.file, decoded)
        self.ok("compare", decoded, self.file)
        self.fails(USAGE, "compare", self.image, self.file)  # other sizes have no PSNR
        said = self.json("compare", self.image, self.file, "--statistics", "--json")
        self.assertEqual((said["psnr_db"], said["ssim"], said["identical"]), (None, None, False))
        self.assertTrue(all(0.3 < said[key] < 3 for key in ("gradient_kept", "seam_ratio")), said)
        said = self.json("compare", self.image, self.image, "--json")
        self.assertEqual((said["gradient_kept"], said["spectrum_distance"], said["seam_ratio"]), (1, 0, None))
        os.unlink(other)
        os.unlink(decoded)


class ReportTest(CommandTest):
    def test_json(self):
        out = self.path("json.btfc")
        verbs = {
            "info": ([self.file], INFO_KEYS),
            "size": (["--model", "patch", "--sample", "64x64", "--k", "3"], SIZE_KEYS),
            "compare": ([self.image, self.image], COMPARE_KEYS),
            "bench": ([self.file, "--seconds", "0.02"], BENCH_KEYS),
            "encode": ([self.image, "-o", out, "--model", "patch", "--k", "3"], ENCODE_KEYS),
            "verify": ([self.file], {"file", "ok", "rule", "offset", "message"}),
            "copy": ([self.file, "-o", out], {"output", "file_bytes", "input_file_bytes", "chunks"}),
        }
        for verb, (args, keys) in verbs.items():
            with self.subTest(verb):
                said = self.json(verb, *args, "--json")
                self.assertEqual(keys - set(said), set())
                beside = self.path(f"{verb}.json")
                text = self.ok(verb, *args, "--json", beside)
                self.assertNotIn("{\n", text)
                self.assertGreater(len(text), 10)
                written = json.loads(Path(beside).read_text())
                self.assertEqual(list(written), list(said))
                # --json before the input must not take the input for its file
                if verb in ("info", "verify", "bench"):
                    before = Path(self.file).read_bytes()
                    self.assertEqual(set(self.json(verb, "--json", *args)), set(said))
                    self.assertEqual(Path(self.file).read_bytes(), before)
        models = self.json("models", "--json")
        self.assertEqual(models[0]["id"], "patch")
        self.ok("models", "--json", self.path("models.json"))
        self.assertEqual(json.loads(Path(self.path("models.json")).read_text()), models)

        done = run("verify", self.path("damaged.btfc"), "--json")
        said = json.loads(done.stdout)
        self.assertEqual((done.returncode, said["ok"]), (INVALID, False))
        self.assertRegex(said["rule"], r"^[A-Z]+[0-9]+$")
        self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_info_adds_up(self):
        said = self.json("info", self.file, "--json")
        self.assertEqual(said["file_bytes"], os.path.getsize(self.file))
        self.assertEqual(said["file_bytes"], said["header_bytes"] + said["index_bytes"] + said["padding_bytes"] +
                         said["stored_bytes"])
        self.assertEqual(said["payload_bits"], said["formula_bits"])
        self.assertEqual(said["raw_bytes_u8"], 36 * 36 * 3)
        texels = said["width"] * said["height"]
        self.assertAlmostEqual(said["bits_per_texel"], said["payload_bits"] / texels)
        self.assertAlmostEqual(said["bits_per_sample"], said["payload_bits"] / texels / 3)
        self.assertAlmostEqual(said["ratio_u8"], 24 * texels / said["payload_bits"])
        self.assertAlmostEqual(said["ratio_u16"], 48 * texels / said["payload_bits"])
        self.assertEqual(said["parameters"]["w_b"], 12)
        self.assertEqual((said["model"], said["format_version"], said["unbounded"]), ("patch", "0.1", False))

    def size(self, *args):
        return self.json("size", "--model", "patch", "--json", "--sample", "64x64", *args)

    def test_size_of_the_paper(self):
        for args, side, bits in ((["--k", "11", "--wb", "36", "--we", "14", "--blend", "liang"], 256, 100304),
                                 (["--k", "11", "--wb", "36", "--we", "14", "--blend", "quilting"], 256, 131984),
                                 (["--k", "20", "--wb", "36", "--we", "14", "--blend", "quilting"], 454, 214208)):
            said = self.size(*args)
            self.assertEqual((said["width"], said["height"], said["paper"]["bits"]), (side, side, bits))
            self.assertEqual(said["payload_bits"], said["formula_bits"])
        k11 = ["--k", "11", "--wb", "36", "--we", "14"]
        # The sample, 61 words of coordinates, the cuts of spec/models/patch.md section 3; PARM as the format has it.
        parm = 8 * [c["raw_bytes"] for c in self.json("info", self.file, "--json")["chunks"] if c["type"] == "PARM"][0]
        for args, cuts in ((["--blend", "liang"], 0), (["--pack", "packed"], 1980), (["--pack", "rgba8"], 3960)):
            self.assertEqual(self.size(*k11, *args)["formula_bits"], 8 * (12288 + 244 + 2 * cuts) + parm)

    def test_size_sweep(self):
        args = ["size", "--model", "patch", "--sample", "64x64", "--wb", "36", "--we", "14", "--blend", "quilting"]
        plot = self.path("sweep.svg")
        said = self.json(*args, "--sweep", "k=2:20:3", "--plot", plot, "--json")
        self.assertEqual((said["sweep"], [p["value"] for p in said["points"]]), ("k", [2, 5, 8, 11, 14, 17, 20]))
        points = {p["value"]: p for p in said["points"]}
        for k, bits in ((11, 131984), (20, 214208)):
            point, alone = points[k], self.json(*args, "--k", str(k), "--json")
            self.assertEqual(point["paper"]["bits"], bits)
            for key in set(point) - {"value"}:
                self.assertEqual(point[key], alone[key], key)
        root = xml.etree.ElementTree.parse(plot).getroot()
        self.assertEqual(root.tag, "{http://www.w3.org/2000/svg}svg")
        texts = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text")]
        self.assertTrue({"k", "bits per texel", "formula", "10", "20"} <= set(texts), texts)

        table = self.ok(*args, "--sweep", "k=2:20:3").splitlines()
        self.assertEqual(table[0].split(), ["k", "width", "height", "formula_bits", "bits_per_texel", "ratio_u8",
                                            "paper.bits", "paper.bits_per_texel"])
        self.assertEqual(len(table), 8)
        self.assertEqual((table[4].split()[:3], table[4].split()[6]), (["11", "256", "256"], "131984"))
        # A value that is not possible says why, in its place.
        said = self.json("size", "--model", "patch", "--sample", "64x64", "--k", "4", "--sweep", "wb=60:70:2", "--json")
        self.assertEqual(["error" in p for p in said["points"]], [False] * 3 + [True] * 3)
        self.assertIn("2 to 64", said["points"][3]["error"])

        size = ["size", "--model", "patch", "--sample", "64x64"]
        for sweep in ("", "k", "k=", "=1:2:1", "k=1:2", "k=1:2:1:1", "k=2:1:1", "k=1:2:0", "k=a:2:1", "k=-1:2:1",
                      "k=1:2:1x", "k=1.5:2:1", "k=0:4000000000:1"):
            self.fails(USAGE, *size, "--sweep", sweep, says="--sweep")
        self.fails(USAGE, *size, "--sweep", "depth=1:2:1", says=("--sweep", "depth"))
        self.fails(USAGE, *size, "--sweep", "tau=1:2:1", says=("--sweep", "tau"))
        self.fails(USAGE, *size, "--k", "3", "--sweep", "tileable=0:1:1", says=("--sweep", "--tileable"))
        self.fails(USAGE, *size, "--k", "3", "--sweep", "k=1:2:1", says=("--sweep", "--k"))
        self.fails(USAGE, *size, "--k", "3", "--sweep", "wb=80:90:1", says=("--wb", "2 to 64"))
        self.fails(USAGE, *size, "--k", "3", "--plot", plot, says="--plot")
        self.fails(IO, *size, "--sweep", "k=1:2:1", "--plot", self.path("no/such/folder/x.svg"), says="x.svg")

    def test_size_foretells_the_file(self):
        for args in (["--k", "3x5", "--wb", "9", "--we", "2"], ["--size", "40x77", "--blend", "liang"],
                     ["--size", "40x77", "--pack", "rgba8", "--wb", "16", "--we", "8"]):
            path = self.encode("foretold.btfc", *args)
            said, info = (self.json("size", "--model", "patch", "--json", "--sample", "32x32", *args),
                          self.json("info", path, "--json"))
            for key in ("width", "height", "payload_bits", "formula_bits", "memory_bits", "paper", "parameters"):
                self.assertEqual(said[key], info[key], key)

    def test_size_refuses(self):
        """Each message says what is possible."""
        size = ["size", "--model", "patch"]
        tiny = self.path("tiny.png")
        files.write_png(tiny, 1, 1, 1, 8, [7])
        encode = ["-o", self.path("out.btfc"), "--model", "patch"]
        self.fails(USAGE, *size, "--sample", "1x1", "--k", "2", says="2x2")
        self.fails(USAGE, "encode", tiny, *encode, "--k", "2", says="2x2")
        self.fails(USAGE, *size, "--sample", "64x48", "--k", "2", "--wb", "49", says=("--wb", "2 to 48"))
        self.fails(USAGE, "encode", self.image, *encode, "--k", "2", "--wb", "33", says=("--wb", "2 to 32"))
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "2", "--wb", "36", "--we", "19", says=("--we", "1 to 18"))
        self.fails(USAGE, "encode", self.image, *encode, "--k", "2", "--wb", "9", "--we", "5", says=("--we", "1 to 4"))
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "2", "--we", "0", says=("--we", "1 to"))
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "5000", says="65536")
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "2", "--size", "400x400", says="2x2 patches")
        self.fails(USAGE, *size, "--sample", "65536x65536", "--k", "1", says="2^27")
        self.fails(USAGE, *size, "--sample", "600x600", "--k", "2", "--wb", "600", "--we", "257", "--pack", "rgba8",
                   says="256")
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "2", "--channels", "5", says=("--channels", "4"))
        self.fails(USAGE, *size, "--sample", "64x64", "--k", "2", "--bits", "12", says=("--bits", "16"))

    def test_maps(self):
        other, rgb = self.path("other-size.png"), self.image
        files.write_png(other, 31, 32, 1, 16, files.noise(31 * 32, 16, 2))
        self.fails(USAGE, "encode", "--map", f"colour={rgb}", "--map", f"height={other}", "-o", self.path("out.btfc"),
                   "--model", "patch", "--k", "2", says=("height", "31x32", "32x32"))
        files.write_png(other, 32, 32, 1, 16, files.noise(32 * 32, 16, 2))
        path = self.encode("maps.btfc", "--map", f"colour={rgb}", "--map", f"height={other}", "--k", "3", image=())
        info = self.json("info", path, "--json")
        self.assertEqual([(m["name"], m["channels"], m["sample_type"]) for m in info["maps"]],
                         [("colour", 3, "unorm8"), ("height", 1, "unorm16")])
        self.ok("decode", path, "-o", self.path("maps.png"))
        self.ok("compare", path, self.path("maps-colour.png"), "--map", "colour")
        self.ok("compare", path, self.path("maps-height.png"), "--map", "height")
        self.assertFalse(Path(self.path("maps.png")).exists())
        self.ok("decode", path, "-o", self.path("one.png"), "--map", "height")
        self.assertEqual(files.read_png(self.path("one.png")), files.read_png(self.path("maps-height.png")))
        self.fails(USAGE, "compare", path, self.path("one.png"), says="--map")
        self.assertEqual(self.json("bench", path, "--map", "height", "--seconds", "0.01", "--json")["map"], "height")


class EncodeTest(CommandTest):
    def test_raw_is_as_large_as_foretold(self):
        for args in (["--blend", "liang"], ["--pack", "packed"], ["--pack", "rgba8"]):
            path = self.encode("raw.btfc", "--k", "4x3", "--codec", "raw", *args)
            said = self.json("info", path, "--json")
            self.assertEqual(said["file_bytes"], said["file_max_bytes"])
            self.assertEqual({c["codec"] for c in said["chunks"]}, {"raw"})
            small = self.json("info", self.encode("zstd.btfc", "--k", "4x3", *args), "--json")
            self.assertLess(small["file_bytes"], said["file_bytes"])
            self.assertEqual(small["file_max_bytes"], said["file_bytes"])
            self.assertEqual([c["raw_hash"] for c in small["chunks"]], [c["raw_hash"] for c in said["chunks"]])

    def test_same_input_same_file(self):
        image = self.path("larger.png")
        self.ok("synth", "pebbles", "-o", image, "--size", "96x96")
        for blend in ("liang", "quilting"):
            args = ["--size", "300x200", "--blend", blend]
            first = Path(self.encode("a.btfc", *args, "--threads", "1", image=image)).read_bytes()
            for more in (["--threads", "2"], [], ["--seed", "1"], ["--threads", "7"]):
                self.assertEqual(Path(self.encode("b.btfc", *args, *more, image=image)).read_bytes(), first, more)
            other = Path(self.encode("b.btfc", *args, "--seed", "2", image=image)).read_bytes()
            self.assertNotEqual(other, first)
            self.assertEqual(Path(self.encode("c.btfc", *args, "--seed", "2", image=image)).read_bytes(), other)

    def test_synthesized(self):
        for blend in ("liang", "quilting"):
            shown = self.path("shown.png")
            path = self.encode("shown.btfc", "--size", "90x71", "--blend", blend, "--synthesized", shown)
            self.ok("compare", path, shown)

    def test_sample_window(self):
        path = self.encode("window.btfc", "--sample", "5,7,20,18", "--k", "1", "--wb", "18", "--we", "0", "--codec",
                           "raw", "--size", "18x18")
        smpl = [c for c in files.read_chunks(Path(path).read_bytes()) if c.type == b"SMPL"][0].stored
        codes = files.read_png(self.image)[4]
        wanted = [code for y in range(7, 25) for code in codes[(32 * y + 5) * 3:(32 * y + 25) * 3]]
        self.assertEqual(list(smpl), wanted)

    def test_failed_writes_leave_what_was(self):
        """The file size limit stands in for a full disk."""
        noisy = self.path("noisy.png")
        files.write_png(noisy, 64, 64, 3, 8, files.noise(64 * 64 * 3, 8, 5))
        floats = self.path("noisy.tif")
        files.write_tiff(floats, 64, 64, 3, [files.half(code) for code in files.half_noise(64 * 64 * 3, 5)])
        texture = self.encode("noisy.btfc", "--k", "5", image=noisy)
        half_texture = self.encode("noisy-half.btfc", "--k", "5", image=floats)
        encode = ["encode", noisy, "--model", "patch", "--k", "5", "-o"]
        place = self.folder / "place"
        place.mkdir()
        for name, args in (("out.btfc", encode), ("copy.btfc", ["copy", texture, "--codec", "raw", "-o"]),
                           ("out.png", ["decode", texture, "-o"]), ("out.exr", ["decode", half_texture, "-o"]),
                           ("synth.png", ["synth", "grain", "--size", "99x99", "-o"]),
                           ("report.json", ["models", "--json"])):
            target = place / name
            for limit in (0, 1, 8):
                if name == "report.json" and limit:
                    continue
                target.write_bytes(b"what was here before\n")
                done = subprocess.run(["sh", "-c", f"trap '' XFSZ; ulimit -f {limit}; exec \"$@\"", "sh", BTFC, *args,
                                       target], capture_output=True, text=True)
                with self.subTest(f"{name}, {limit} blocks"):
                    self.assertEqual(done.returncode, IO, done.stderr)
                    self.assertIn(name, done.stderr)
                    self.assertEqual(target.read_bytes(), b"what was here before\n")
                    self.assertEqual([p.name for p in place.iterdir()], [name])
            target.unlink()

    def test_outputs_have_the_usual_mode(self):
        path = self.encode("mode.btfc", "--k", "2")
        mask = os.umask(0)
        os.umask(mask)
        self.assertEqual(os.stat(path).st_mode & 0o777, 0o666 & ~mask)


class CopyTest(CommandTest):
    def test_there_and_back(self):
        raw = self.encode("raw.btfc", "--k", "4", "--codec", "raw")
        small, back, here = self.path("small.btfc"), self.path("back.btfc"), self.path("here.btfc")
        self.ok("copy", raw, "-o", small)
        self.ok("copy", small, "-o", back, "--codec", "raw")
        self.assertLess(os.path.getsize(small), os.path.getsize(raw))
        self.assertEqual(Path(back).read_bytes(), Path(raw).read_bytes())
        self.assertEqual(Path(small).read_bytes(), Path(self.encode("zstd.btfc", "--k", "4")).read_bytes())
        self.ok("compare", raw, small)
        Path(here).write_bytes(Path(raw).read_bytes())
        self.ok("copy", here, "-o", here)  # onto itself
        self.assertEqual(Path(here).read_bytes(), Path(small).read_bytes())
        for align in (16, 256, 65536):
            self.ok("copy", raw, "-o", here, "--align", align)
            self.ok("verify", here)
            for chunk in self.json("info", here, "--json")["chunks"]:
                self.assertEqual(chunk["offset"] % align, 0)

    @unittest.skipIf(xxhash is None, "python module xxhash is missing")
    def test_unknown_chunks_are_kept(self):
        chunks = files.read_chunks(Path(self.encode("plain.btfc", "--k", "2", "--codec", "raw")).read_bytes())
        content = b"kept as it is, byte for byte. " * 20
        own = [files.raw_chunk(b"NOTE", files.SAFE_TO_COPY, content, 3), files.raw_chunk(b"priv", 0, content[::-1], 1)]
        path, out, back = self.path("unknown.btfc"), self.path("copied.btfc"), self.path("again.btfc")
        Path(path).write_bytes(files.build_file(chunks + own))
        self.ok("verify", path)
        self.ok("copy", path, "-o", out)
        self.ok("verify", out)
        before, after = self.json("info", path, "--json"), self.json("info", out, "--json")
        self.assertLess(after["file_bytes"], before["file_bytes"])
        for key in ("type", "flags", "level", "part", "tile", "raw_bytes", "raw_hash"):
            self.assertEqual([c[key] for c in before["chunks"]], [c[key] for c in after["chunks"]])
        self.assertEqual({c["codec"] for c in after["chunks"] if c["type"] in ("NOTE", "priv")}, {"zstd"})
        self.ok("copy", out, "-o", back, "--codec", "raw")
        self.assertEqual(Path(back).read_bytes(), Path(path).read_bytes())
        self.ok("decode", path, "-o", self.path("unknown.png"))


class DecodeTest(CommandTest):
    def test_region_is_a_crop(self):
        for name, image, more in (("rgb", self.image, []), ("grey", self.grey, ["--blend", "liang"])):
            path, whole, part = self.encode("region.btfc", "--size", "61x53", *more, image=image), self.path(
                "whole.png"), self.path("part.png")
            self.ok("decode", path, "-o", whole)
            width, height, channels, bits, codes = files.read_png(whole)
            self.assertEqual((width, height), (61, 53))
            for x, y, w, h in ((0, 0, 61, 53), (0, 0, 1, 1), (60, 52, 1, 1), (17, 9, 30, 31), (0, 52, 61, 1)):
                self.ok("decode", path, "-o", part, "--region", f"{x},{y},{w},{h}")
                wanted = [c for row in range(y, y + h) for c in codes[(width * row + x) * channels:
                                                                       (width * row + x + w) * channels]]
                self.assertEqual(files.read_png(part), (w, h, channels, bits, wanted), f"{name} {x},{y},{w},{h}")

    def largest(self):
        """65,536 x 65,536 texels of 33 x 33 patches that all show the whole sample, and the sample."""
        codes = bytes(x * 7 + y * 13 + (x * y >> 5) & 255 for y in range(2048) for x in range(2048))
        image, path = self.path("large.png"), self.path("largest.btfc")
        files.write_png(image, 2048, 2048, 1, 8, codes)
        small = self.encode("small.btfc", "--wb", "2048", "--we", "64", "--k", "1", "--blend", "liang", "--codec", "raw",
                            image=image)
        # Grown by hand: the encoder would take half a minute for it.
        chunks = {c.type: c.stored for c in files.read_chunks(Path(small).read_bytes())}
        head, parm = chunks[b"HEAD"], chunks[b"PARM"]
        head = head[:4] + struct.pack("<2I", 65536, 65536) + head[12:]
        parm = parm[:8] + struct.pack("<2I", 33, 33) + parm[16:]
        payload = files.CRITICAL | files.PAYLOAD
        Path(path).write_bytes(files.build_file([
            files.raw_chunk(b"HEAD", files.CRITICAL, head), files.raw_chunk(b"PARM", payload, parm),
            files.raw_chunk(b"SMPL", payload, chunks[b"SMPL"]),
            files.raw_chunk(b"COOR", payload, bytes(4 * 33 * 33))]))
        return path, codes

    def btf(self):
        """A data set of 10 views and 5 lights, named as in UBO2003."""
        folder = Path(tempfile.mkdtemp(dir=self.folder)) / "btf"
        btf_sets.write_named_set(folder, btf_sets.GRID, btf_sets.RING, (7, 5))
        return folder

    def test_btf_there_and_back(self):
        folder, path = self.btf(), self.path("btf.btfc")
        for model, options in (("ptm", []), ("plm", []), ("pcarf", ["--rank", "4"]), ("pca", ["--rank", "49"]),
                               ("lpca", ["--clusters", "3", "--rank", "9"]),
                               ("gm", ["--components", "40", "--iterations", "300"])):
            with self.subTest(model):
                made = self.json("encode", folder, "-o", path, "--model", model, *options, "--json")
                self.assertEqual(made["payload_bits"], made["formula_bits"])
                self.ok("verify", path)
                said = self.json("info", path, "--json")
                self.assertEqual((said["views"], said["lights"], said["pairs"]), (10, 5, 50))
                self.assertEqual(said["cost"]["bytes"], 4 * said["cost"]["reads"])
                done = run("compare", folder, path, "--measures", "psnr", "--json")
                self.assertIn(done.returncode, (0, 7), done.stderr)
                psnr = json.loads(done.stdout)["psnr_db"] or 99  # null: no difference at 16 bits
                self.assertGreater(psnr, 90 if model in ("pca", "pcarf") else 12 if model == "gm" else 18)  # 49 and 4 components hold all there is
                for out in ("out", "out.exr"):
                    self.ok("decode", path, "-o", self.path(f"{model}-{out}"), "--directions", "all")
                    done = run("compare", folder, self.path(f"{model}-{out}"), "--measures", "psnr", "--json")
                    self.assertAlmostEqual(json.loads(done.stdout)["psnr_db"] or 99, min(psnr, 99), delta=1 if psnr < 40 else 60)
                one = self.path(f"{model}.png")
                self.ok("decode", path, "-o", one, "--view", "75,80", "--light", "35,90")
                self.assertEqual(files.read_png(one)[:3], (7, 5, 3))

    def test_btf_levels_and_sheets(self):
        folder, path = self.btf(), self.path("btf.btfc")
        self.ok("encode", folder, "-o", path, "--model", "pca", "--rank", "8")
        pictures = []
        for levels in ("0", "2", "8", "9"):
            out = self.path(f"{levels}.png")
            self.ok("decode", path, "-o", out, "--levels", levels, "--view", "40,20")
            pictures.append(files.read_png(out)[4])
        self.assertNotEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[2], pictures[3])
        self.ok("decode", path, "-o", self.path("sheet.png"), "--directions", "all")
        self.assertGreater(files.read_png(self.path("sheet.png"))[0], 7)
        self.ok("bench", path, "--seconds", "0.02")

    def test_mixture(self):
        folder, path, state = self.btf(), self.path("gm.btfc"), self.path("gm.state")
        encode = ["encode", folder, "-o", path, "--model", "gm", "--seed", "4"]
        made = self.json(*encode, "--bytes", "1500", "--iterations", "200", "--json")
        self.assertLessEqual(made["payload_bits"], 8 * 1500)
        said = self.json("info", path, "--json")
        self.assertEqual(said["parameters"]["components"], made["components"])
        self.assertEqual(said["meta"]["gm.iterations"], "200")
        # A fit that stops by the clock says what gives the same again.
        made = self.json(*encode, "--components", "16", "--time-limit", "0.3", "--json")
        by_time = Path(path).read_bytes()
        self.ok(*encode, "--components", "16", "--iterations", str(made["iterations"]))
        self.assertEqual(Path(path).read_bytes(), by_time)
        # A state of another fit, and what is none, are refused and kept.
        Path(state).write_bytes(b"nothing of the kind")
        self.fails(INVALID, *encode, "--components", "8", "--iterations", "9", "--checkpoint", state, says=state)
        self.assertEqual(Path(state).read_bytes(), b"nothing of the kind")
        nowhere = self.path("none") + "/gm.state"  # told before time is spent
        self.fails(IO, *encode, "--components", "8", "--checkpoint", nowhere, says=nowhere)
        self.ok(*encode, "--components", "8", "--fit", "em", "--iterations", "4", "--layout", "paper")
        whole = Path(path).read_bytes()
        Path(state).unlink()
        self.ok(*encode, "--components", "8", "--fit", "em", "--iterations", "4", "--layout", "paper", "--checkpoint", state)
        Path(path).unlink()
        self.ok(*encode, "--components", "8", "--fit", "em", "--iterations", "4", "--layout", "paper", "--checkpoint", state)
        self.assertEqual(Path(path).read_bytes(), whole)
        # Far away the picture is flat.
        spread = []
        for footprint in ("1", "1000"):
            out = self.path("far.png")
            self.ok("decode", path, "-o", out, "--view", "40,20", "--footprint", footprint)
            codes = files.read_png(out)[4]
            spread.append(max(codes[::3]) - min(codes[::3]))
        self.assertGreater(spread[0], spread[1])
        self.assertLessEqual(spread[1], 1)
        sheet = self.path("sheet.png")
        self.assertEqual(run("compare", folder, path, "--measures", "psnr", "--sheet", sheet).returncode, 7)
        self.assertGreater(files.read_png(sheet)[0], 8 * 200)
        for wrong in (["--gates", "33"], ["--components", "0"], ["--layout", "paper", "--precision", "u8"], ["--bytes", "100"],
                      ["--decode-cost", "3"], ["--shear", "on", "--fit", "em"], ["--epsilon", "0.1"], ["--levels", "17"],
                      ["--bytes", "2000", "--components", "9"], ["--time-limit", "1", "--iterations", "9"],
                      ["--mean-brdf", "u8", "--mean-rank", "2"], ["--psnr", "0"]):
            with self.subTest(wrong):
                self.fails(USAGE, *encode, *wrong, says=wrong[0])

    def test_unbounded(self):
        picture, path, whole, part = (self.path(n) for n in ("grain.png", "grain.btfc", "whole.png", "part.png"))
        self.ok("synth", "grain", "-o", picture, "--size", "64x64")
        said = self.json("encode", picture, "-o", path, "--model", "car", "--levels", "2", "--json")
        self.assertEqual((said["clusters"], said["unstable_after_repair"]), (1, 0))
        self.ok("verify", path)
        # A window of a window, far from the origin; equal but for the last step of a code.
        self.ok("decode", path, "-o", whole, "--size", "40x30", "--origin=-1000000,77")
        self.ok("decode", path, "-o", part, "--size", "8x6", "--origin=-999990,80")
        width, _, channels, _, codes = files.read_png(whole)
        inner = files.read_png(part)
        for y in range(6):
            for x in range(8 * channels):
                self.assertLessEqual(abs(codes[(y + 3) * width * channels + 10 * channels + x] - inner[4][y * 8 * channels + x]), 1)
        # A torus of 32 texels, and the same texels a period on.
        self.ok("decode", path, "-o", whole, "--size", "64x32", "--periodic", "32")
        width, height, channels, _, codes = files.read_png(whole)
        row = 32 * channels
        for y in range(height):
            at = y * width * channels
            self.assertEqual(codes[at:at + row], codes[at + row:at + 2 * row])
        self.assertEqual(files.read_png(self.path("grain.png"))[:2], (64, 64))
        out = self.path("none")
        for option, value, says in (("--size", "0x4", "--size"), ("--size", "4", "--size"), ("--origin", "1", "--origin"),
                                    ("--origin", "2147483647,0", "2^31"), ("--periodic", "3", "multiple of 2")):
            self.fails(USAGE, "decode", path, "-o", out, option, value, says=says)
        self.fails(USAGE, "decode", path, "-o", out, "--size", "4x4", "--region", "0,0,1,1", says="--region")
        self.fails(USAGE, "decode", self.file, "-o", out, "--size", "4x4", says="not unbounded")
        self.fails(USAGE, "decode", self.file, "-o", out, "--periodic", "4", says="not unbounded")
        self.fails(USAGE, "encode", picture, "-o", out, "--model", "car", "--order", "41", says="--order")
        self.fails(USAGE, "encode", picture, "-o", out, "--model", "car", "--clusters", "2", says="--clusters")
        self.fails(USAGE, "encode", picture, "-o", out, "--model", "car", "--range", "8x8", says="--range")
        self.assertFalse(Path(out).exists())

    def test_shaders(self):
        """By Vulkan: the same codes as by the CPU, silent under validation; without a device exit code 5."""
        out, cpu = self.path("s.png"), self.path("c.png")
        without = {"env": {**os.environ, "VK_ICD_FILENAMES": "/nonexistent", "VK_DRIVER_FILES": "/nonexistent"}}
        decode = ["decode", self.file, "-o", out, "--device", "vulkan"]
        bench = ["bench", self.file, "--seconds", "0.02"]
        self.fails(UNSUPPORTED, *decode, says="no Vulkan device", **without)
        self.assertFalse(Path(out).exists())
        self.fails(UNSUPPORTED, *bench, "--device", "vulkan", says="no Vulkan device", **without)
        self.assertNotIn("vulkan_device", json.loads(run(*bench, "--json", **without).stdout))
        self.fails(USAGE, *decode[:-1], "cuda", says="cuda")
        self.fails(USAGE, "decode", self.file, "-o", out, "--validation", says="--device vulkan")
        done = run(*decode, "--json")
        if done.returncode == UNSUPPORTED:
            self.skipTest(done.stderr.strip())
        self.assertTrue(json.loads(done.stdout)["device"])
        self.ok("decode", self.file, "-o", cpu)
        self.assertEqual(Path(out).read_bytes(), Path(cpu).read_bytes())
        # An unbounded texture, in several blocks.
        picture, field = self.path("p.png"), self.path("f.btfc")
        self.ok("synth", "grain", "-o", picture, "--size", "48x48")
        self.ok("encode", picture, "-o", field, "--model", "gmrf", "--levels", "2", "--torus", "64")
        window = ["--size", "600x20", "--origin=-7,-3"]
        self.ok("decode", field, "-o", cpu, *window)
        done = run("decode", field, "-o", out, *window, "--device", "vulkan", "--validation")
        if "not installed" in done.stderr:
            self.skipTest(done.stderr.strip())
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertLessEqual(self.json("compare", cpu, out, "--json")["peak_8bit"], 1)

    def test_btf_mistakes(self):
        folder, path, picture = self.btf(), self.path("btf.btfc"), self.path("picture.png")
        self.ok("synth", "grain", "-o", picture, "--size", "32x32")
        self.ok("encode", folder, "-o", path, "--model", "pca", "--rank", "1")
        out = self.path("none")
        self.fails(USAGE, "encode", picture, "-o", out, "--model", "pca", says=("no data set", "pca"))
        self.fails(USAGE, "encode", folder, picture, "-o", out, "--model", "pca", says="one data set")
        self.fails(USAGE, "encode", "--map", f"a={picture}", "-o", out, "--model", "lpca", says="--map")
        self.fails(USAGE, "encode", folder, "-o", out, "--model", "patch", says="data set")
        self.fails(USAGE, "encode", folder, "-o", out, "--model", "pca", "--rank", "256", says="--rank")
        self.fails(USAGE, "encode", folder, "-o", out, "--model", "pca", "--clusters", "2", says="--clusters")
        self.fails(USAGE, "encode", picture, "-o", out, "--model", "patch", "--k", "1", "--crop", "0,0,2,2", says="--crop")
        for option, value in (("--view", "91,0"), ("--view", "30"), ("--light", "a,b"), ("--light", "10,20,30")):
            self.fails(USAGE, "decode", path, "-o", out, option, value, says=(option, value))
        self.fails(USAGE, "decode", path, "-o", out, "--directions", "all", "--region", "0,0,1,1", says="--directions")
        self.fails(USAGE, "decode", path, "-o", out, "--directions", "all", "--footprint", "4", says="--footprint")
        self.assertFalse(Path(out).exists())

    def test_btf_size_sweep(self):
        size = ["size", "--model", "pca", "--rank", "41"]
        for sweep in ("size=25:200:25", "directions=11:151:20"):
            more = [] if sweep.startswith("size") else ["--size", "100"]
            said = self.json(*size, *more, "--sweep", sweep, "--plot", self.path("s.svg"), "--json")
            ratios = [p["paper"]["ratio"] for p in said["points"]]
            self.assertEqual(ratios, sorted(ratios))  # the survey's Fig. 12: both curves rise
        self.assertIn("compression ratio", Path(self.path("s.svg")).read_text())

    @unittest.skipIf(xxhash is None, "python module xxhash is missing")
    def test_largest_texture_by_regions(self):
        path, sample = self.largest()
        self.ok("verify", path)
        part = self.path("part.png")
        # Inside one patch, where the answer is the sample's texel: patch (16, 20) begins at 1984 times its number.
        for x, y, w, h in ((16 * 1984 + 64, 20 * 1984 + 64, 512, 400), (65535, 65535, 1, 1), (0, 0, 300, 2),
                           (32 * 1984 + 100, 5, 40, 50)):
            status, peak, seconds = peak_of("decode", path, "-o", part, "--region", f"{x},{y},{w},{h}")
            self.assertEqual(status, 0)
            self.assertLess(peak, 700 << 20)
            self.assertLess(seconds, 30)

            def local(at):
                return at - min(at // 1984, 32) * 1984

            wanted = [code for row in range(y, y + h) for code in sample[2048 * local(row) + local(x):][:w]]
            self.assertEqual(files.read_png(part), (w, h, 1, 8, wanted))
        # Rows through all 33 patches, the overlaps included.
        status, peak, seconds = peak_of("decode", path, "-o", part, "--region", "0,30000,65536,64")
        self.assertEqual((status, files.read_png(part)[:2]), (0, (65536, 64)))
        self.assertLess(peak, 700 << 20)
        print(f"\n65536x65536: region of 65536x64 in {seconds:.1f} s, peak {peak >> 20} MiB", file=sys.stderr)

    @unittest.skipIf(os.environ.get("BTFC_SANITIZED"), "the memory of a sanitized build says nothing")
    def test_encoder_at_full_width(self):
        """Four rows of patches across 65,536 texels: time grows with the texels, memory does not."""
        image, path = self.path("large.png"), self.path("wide.btfc")
        files.write_png(image, 2048, 2048, 1, 8,
                        bytes(x * 7 + y * 13 + (x * y >> 5) & 255 for y in range(2048) for x in range(2048)))
        status, peak, seconds = peak_of("encode", image, "-o", path, "--model", "patch", "--wb", "2048", "--we", "64",
                                        "--blend", "liang", "--size", f"65536x{HEIGHT}")
        print(f"\nencode 65536x{HEIGHT}: {seconds:.1f} s, peak {peak >> 20} MiB", file=sys.stderr)
        self.assertEqual(status, 0)
        self.assertLess(peak, 1 << 30)
        said = self.json("info", path, "--json")
        self.assertEqual((said["width"], said["height"]), (65536, HEIGHT))
        status, peak, _ = peak_of("decode", path, "-o", self.path("part.png"), "--region",
                                  f"40000,{HEIGHT - 300},300,300")
        self.assertEqual(status, 0)
        self.assertLess(peak, 700 << 20)


def main():
    global BTFC, SOURCE, HEIGHT
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--source", type=Path, default=files.ROOT)
    parser.add_argument("--full-height", action="store_true", help="encode 65,536 x 65,536 texels, half a minute")
    args, rest = parser.parse_known_args()
    BTFC, SOURCE = str(Path(args.btfc).resolve()), args.source.resolve()
    if args.full_height:
        HEIGHT = 65536
    unittest.main(argv=[sys.argv[0], *rest])


class DatasetTest(CommandTest):
    """A directory named as UBO2003: two views, three lights."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.set = cls.folder / "set"
        cls.set.mkdir()
        cls.names = []
        for tv, pv in ((0, 0), (30, 90)):
            for tl, pl in ((0, 0), (15, 0), (15, 60)):
                name = f"{len(cls.names):05} tl{tl:03} pl{pl:03} tv{tv:03} pv{pv:03}.png"
                cls.names.append(name)
                files.write_png(str(cls.set / name), 24, 20, 3, 8, files.noise(24 * 20 * 3, 8, len(cls.names)))

    def test_forms(self):
        told = self.json("convert", self.set, "--json")
        self.assertEqual([told[k] for k in ("kind", "width", "height", "channels", "views", "lights", "pairs")],
                         ["ubo2003", 24, 20, 3, 2, 3, 6])
        self.assertEqual(told["raw_bytes"], 24 * 20 * 3 * 6)
        for out in ("again", "again.exr"):
            self.ok("convert", self.set, "-o", self.path(out))
            self.ok("compare", self.set, self.path(out))
        self.ok("convert", self.set, "-o", self.path("sheet.png"), "--sheet", "4")
        self.assertEqual(files.read_png(self.path("sheet.png"))[:2], (2 * 24 + 4, 2 * 20 + 4))

    def test_crop_and_tile(self):
        self.ok("convert", self.set, "--crop", "3,4,16,12", "-o", self.path("crop.exr"))
        self.ok("compare", "--crop", "3,4,16,12", self.set, self.set)
        self.assertEqual(self.json("convert", self.path("crop.exr"), "--json")["width"], 16)
        told = self.json("convert", self.set, "--tile", "12x10", "-o", self.path("tile.exr"), "--json")
        self.assertEqual((told["tile"]["width"], told["tile"]["height"], len(told["tile"]["seams"])), (12, 10, 1))
        self.assertTrue(self.json("convert", self.path("tile.exr"), "--json")["wraps"])
        self.ok("convert", self.set, "--tile", "8x8", "--tiles", "2", "-o", self.path("two"))
        self.assertTrue(Path(self.path("two-1")).is_dir() and Path(self.path("two-2")).is_dir())

    def test_compare(self):
        other = self.folder / "other"
        shutil.copytree(self.set, other)
        files.write_png(str(other / self.names[4]), 24, 20, 3, 8, [0] * (24 * 20 * 3))
        done = run("compare", self.set, other, "--json")
        self.assertEqual(done.returncode, 7, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual([v["psnr_db"] is None for v in told["views"]], [True, False])
        self.assertIsNone(told["theta_above_45"]["psnr_db"])
        self.assertEqual(told["theta_to_45"]["pairs"], 6)
        self.assertGreater(told["flip"], 0)
        quick = json.loads(run("compare", self.set, other, "--measures", "psnr", "--json").stdout)
        self.assertEqual((quick["psnr_db"], quick["flip"], quick["ssim"]), (told["psnr_db"], None, None))

    def test_missing(self):
        gap = self.folder / "gap"
        shutil.copytree(self.set, gap)
        (gap / self.names[3]).unlink()
        self.fails(3, "convert", gap, says="missing")
        done = run("convert", gap, "--missing", "skip", "--json")
        self.assertEqual(done.returncode, 0)
        self.assertIn("missing", done.stderr)
        self.assertEqual((json.loads(done.stdout)["pairs"], json.loads(done.stdout)["full_product"]), (5, False))
        # Left out of the fit and reconstructed; the file answers for the sixth pair too.
        path = self.path("gap.btfc")
        done = run("encode", gap, "-o", path, "--model", "car", "--clusters", "2", "--range", "0", "--levels", "1",
                   "--order", "2", "--missing", "model", "--json")
        self.assertEqual((done.returncode, json.loads(done.stdout)["reconstructed_pairs"]), (0, 1), done.stderr)
        self.assertEqual(self.json("info", path, "--json")["pairs"], 6)
        told = run("compare", self.set, path, "--resample", "--measures", "psnr", "--json")
        self.assertEqual(json.loads(told.stdout)["pairs"], 6)
        self.assertLess(json.loads(told.stdout)["brdf_rmse_8bit"], 40)
        self.fails(1, "compare", self.set, self.set, "--resample", says="--resample")
        self.fails(1, "encode", gap, "-o", path, "--model", "pca", "--missing", "model", says="--missing")

    def test_errors(self):
        self.fails(1, "convert", says="INPUT")
        self.fails(1, "convert", self.image, says="no data set")
        self.fails(1, "convert", self.set, "--crop", "0,0,25,1", says="25")
        self.fails(1, "convert", self.set, "--crop", "1,2,3", says="--crop")
        self.fails(1, "convert", self.set, "--tile", "24x20", says="24x20")
        self.fails(1, "convert", self.set, "--tile", "big", says="--tile")
        self.fails(1, "convert", self.set, "--tiles", "2", says="--tile")
        self.fails(2, "convert", self.set, "--scratch", "/nowhere", says="/nowhere")
        self.fails(1, "compare", self.set, self.image, says="no data set")
        self.fails(1, "compare", self.image, self.image, "--missing", "skip", says="data sets")
        self.fails(1, "compare", self.image, self.image, "--measures", "beauty", says="beauty")
        self.fails(1, "synth", "btf:wool", "-o", self.path("wool.exr"), says="knit")
        self.fails(1, "synth", "btf:knit", "--type", "unorm16", "-o", self.path("knit.exr"))

    def test_synth(self):
        out = self.path("knit.exr")
        told = self.json("synth", "btf:knit", "--size", "4x3", "-o", out, "--json")
        self.assertEqual((told["views"], told["lights"]), (81, 81))
        self.assertTrue(Path(told["height_map"]).exists() and Path(told["normal_map"]).exists())
        read = self.json("convert", out, "--json")
        self.assertEqual((read["pairs"], read["width"], read["height"], read["wraps"]), (6561, 4, 3, True))


class SceneTest(CommandTest):
    """Only what a scene requires: read, fitted, stored, measured; and scenes made from cameras."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.set = cls.folder / "set"
        btf_sets.write_named_set(cls.set, btf_sets.GRID, btf_sets.RING, (8, 8))

    def scene(self, name="scene.json", **members):
        path = self.folder / name
        path.write_text(json.dumps(members))
        return path

    def noted(self, *args):
        """JSON of a verb that reads less than there is, and says so."""
        done = run(*args)
        self.assertIn(done.returncode, (0, DIFFERENT), done.stderr)
        return json.loads(done.stdout), done.stderr

    def test_other_images_are_not_read(self):
        scene = self.scene(views={"theta": [0, 40]}, lights={"list": [[0, 0], [35, 90]]}, region=[2, 1, 4, 6],
                           tolerance=25)
        broken = self.folder / "broken"
        shutil.copytree(self.set, broken)
        kept = 0
        for path in broken.iterdir():
            wanted = any(t in path.name for t in ("tv000", "tv040")) and any(
                t in path.name for t in ("tl000 pl000", "tl035 pl090"))
            kept += wanted
            if not wanted:
                path.write_bytes(b"no image")
        self.assertEqual(kept, 8)
        out = self.path("scene.btfc")
        told, said = self.noted("encode", broken, "-o", out, "--model", "pca", "--rank", "4", "--scene", scene, "--json")
        self.assertEqual((told["images_read"], told["width"], told["height"]), (8, 4, 6))
        self.assertIn("8 of 50 images were read", said)
        info = self.json("info", out, "--json")
        self.assertEqual((info["views"], info["lights"], info["pairs"]), (4, 2, 8))
        self.assertEqual(info["domain"], {
            "views": {"kind": "range", "theta": [0, 40], "phi": [0, 360]},
            "lights": {"kind": "list", "list": [[0, 0], [35, 90]]},
            "tolerance": 25, "radius": 0, "origin": [2, 1], "scale": 1, "footprints": None})
        self.ok("verify", out)
        # The unrestricted file over the same domain, and both measured against the set.
        whole = self.path("whole.btfc")
        self.ok("encode", self.set, "-o", whole, "--model", "pca", "--rank", "4")
        figures = {}
        for name, path in (("scene", out), ("whole", whole)):
            told, _ = self.noted("compare", broken, path, "--scene", scene, "--json")
            self.assertEqual((told["pairs"], "weighted" in told), (8, False))
            figures[name] = told["psnr_db"] or 99
        self.assertGreater(figures["scene"], figures["whole"])
        # Decoding outside says so and answers.
        done = run("decode", out, "-o", self.path("out.png"), "--view", "70,0", "--light", "35,90")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r"outside .*: the view;")
        self.ok("decode", out, "-o", self.path("out.png"), "--view", "41,20", "--light", "35,90")

    def test_weights_scale_and_channels(self):
        scene = self.scene(lights={"list": [{"direction": [0, 0], "weight": 3}, [35, 0]]}, footprints=[2.5, 8],
                           channels=["G"], weights="cosine")
        out = self.path("scaled.btfc")
        told, _ = self.noted("encode", self.set, "-o", out, "--model", "lpca", "--clusters", "2", "--rank", "3",
                             "--scene", scene, "--json")
        self.assertEqual((told["width"], told["height"], told["images_read"]), (4, 4, 20))
        info = self.json("info", out, "--json")
        self.assertEqual((info["channels"], info["domain"]["scale"], info["domain"]["footprints"]), (1, 2, [1.25, 4]))
        told, _ = self.noted("compare", self.set, out, "--scene", scene, "--json")
        self.assertTrue(told["weighted"])
        self.assertEqual(told["pairs"], 20)
        done = run("decode", out, "-o", self.path("out.png"), "--footprint", "5")
        self.assertIn("the footprint", done.stderr)

    def test_target(self):
        scene = self.scene(views={"theta": [0, 40]}, target={"bytes": 1500})
        told, _ = self.noted("encode", self.set, "-o", self.path("gm.btfc"), "--model", "gm", "--iterations", "20",
                             "--scene", scene, "--json")
        self.assertLessEqual(told["payload_bits"], 8 * 1500)
        self.fails(USAGE, "encode", self.set, "-o", self.path("x.btfc"), "--model", "gm", "--psnr", "20", "--scene", scene,
                   says="target")
        self.fails(USAGE, "encode", self.set, "-o", self.path("x.btfc"), "--model", "pca", "--scene", scene,
                   says=("--bytes", "auto"))

    def test_textures(self):
        scene = self.scene(region=[4, 4, 24, 24], footprints=[2, 4], channels=[0, 2])
        out = self.path("texture.btfc")
        self.ok("encode", self.image, "-o", out, "--model", "patch", "--k", "4", "--wb", "6", "--we", "2", "--scene", scene)
        info = self.json("info", out, "--json")
        self.assertEqual((info["channels"], info["parameters"]["sample_width"], info["domain"]["origin"]), (2, 12, [4, 4]))
        self.fails(USAGE, "encode", self.image, "-o", out, "--model", "patch", "--scene", self.scene(views={"theta": [0, 9]}),
                   says="no directions")
        self.fails(USAGE, "encode", self.image, "-o", out, "--model", "patch", "--scene", self.scene(footprints=[3, 9],
                   region=[0, 0, 5, 4]), says="region of 4x4")

    def test_mistakes(self):
        encode = ["encode", self.set, "-o", self.path("x.btfc"), "--model", "pca"]
        self.fails(INVALID, *encode, "--scene", self.scene(view={}), says="'view'")
        self.fails(IO, *encode, "--scene", "nowhere.json", says="nowhere.json")
        self.fails(USAGE, *encode, "--scene", self.scene(region=[0, 0, 4, 4]), "--crop", "0,0,4,4", says="--crop")
        self.fails(USAGE, *encode, "--scene", self.scene(region=[0, 0, 9, 4]), says="8x8")
        self.fails(USAGE, *encode, "--scene", self.scene(channels=["X"]), says="'X'")

    def seen(self, **members):
        """The scene of CAMERAS.json, beside what the command says."""
        cameras = self.scene("cameras.json", **members)
        told = self.json("scene", "from-camera", cameras, "-o", self.path("seen.json"), "--json")
        return json.loads(Path(self.path("seen.json")).read_text()), told

    def test_plane_from_cameras(self):
        plane = {"kind": "plane", "size": [100, 100], "texels_per_unit": 8}
        camera = {"position": [0, -3, 3], "look_at": [0, 0, 0], "fov": 2}
        scene, told = self.seen(surface=plane, image=[5, 5], cameras=[camera], cell=9,
                                lights=[{"direction": [1, 0, 1]}, {"direction": [0, 0, -1]}, {"position": [0, 4, 0.001]}])
        self.assertEqual((told["frames"], told["pixels"], told["samples"]), (1, 25, 50))
        pairs = sorted(scene["pairs"], key=lambda p: p["light"])
        self.assertEqual(len(pairs), 2)
        for pair, light in zip(pairs, ([45, 0], [90, 90])):
            self.assertAlmostEqual(pair["weight"], 0.5)
            for found, angle in zip(pair["view"] + pair["light"], [45, 270] + light):
                self.assertAlmostEqual(found, angle, delta=0.1)
        # A pixel's side at the distance over the cosine, in texels; half a field about the middle.
        size = 2 * math.tan(math.radians(1)) / 5 * math.sqrt(18) * 8 / math.cos(math.radians(45))
        self.assertLess(scene["footprints"][0], size)
        self.assertGreater(scene["footprints"][1], size)
        self.assertLess(scene["footprints"][1], 1.1 * size)
        # As an encoder takes it.
        self.noted("encode", self.set, "-o", self.path("x.btfc"), "--model", "pca", "--rank", "2", "--scene",
                   self.path("seen.json"), "--json")

    def test_sphere_and_path(self):
        ball = {"kind": "sphere", "radius": 1, "texels_per_unit": 10}
        camera = {"position": [4, 0, 0], "look_at": [0, 0, 0], "fov": 40}
        scene, told = self.seen(surface=ball, image=[40, 40], cameras=[camera], lights=[{"direction": [1, 0, 0]}])
        # The sphere's outline is a cone of asin(1/4) about the axis: its share of the picture.
        self.assertAlmostEqual(told["pixels"] / 1600, math.pi / 4 * (math.tan(math.asin(0.25)) / math.tan(math.radians(20))) ** 2,
                               delta=0.02)
        self.assertEqual(told["samples"], told["pixels"])  # the light stands where the camera does
        for pair in scene["pairs"]:
            # Light and view lie in one plane with the normal; the view leans farther out, for it comes from nearby.
            self.assertGreaterEqual(pair["view"][0] + 0.5, pair["light"][0])
            if pair["view"][0] > 30:
                self.assertLess(abs((pair["view"][1] - pair["light"][1] + 180) % 360 - 180), 15)
        # A light from the side leaves half of it dark; three frames of a path.
        _, told = self.seen(surface=ball, image=[40, 40], cameras=[camera, {**camera, "position": [4, 0, 1]}], steps=2,
                            lights=[{"direction": [0, 1, 0]}], most_pairs=3)
        self.assertEqual((told["frames"], told["joint"]), (3, False))
        self.assertAlmostEqual(told["samples"] / told["pixels"], 0.5, delta=0.02)

    def test_mesh(self):
        # Two squares: the upper one, a quarter as large, shades a part of the lower one. u to the right, v to the top.
        (self.folder / "squares.obj").write_text(
            "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -.5 -.5 1\nv .5 -.5 1\nv .5 .5 1\nv -.5 .5 1\n"
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\nf 5/1 6/2 7/3 8/4\n")
        mesh = {"kind": "mesh", "file": "squares.obj", "texels": [64, 64]}
        camera = {"position": [0, 0, 100], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 2}
        scene, told = self.seen(surface=mesh, image=[64, 64], cameras=[camera], lights=[{"direction": [0.5, 0, 1]}])
        frame = 2 * 100 * math.tan(math.radians(1))  # of the lower square's plane
        # The lower square, 2 of the frame's 3.49 units, holds the centres of 36 x 36 pixels.
        self.assertEqual(told["pixels"], 36 * 36)
        # In shadow and seen from above: what the upper square's shadow, shifted by half a unit, leaves uncovered.
        self.assertAlmostEqual(told["samples"] / told["pixels"], 1 - 0.5 / 4, delta=0.02)
        for pair in scene["pairs"]:
            self.assertAlmostEqual(pair["light"][0], math.degrees(math.atan(0.5)), delta=0.6)
            self.assertLess(pair["view"][0], 1)
        # The upper square has its 64 texels on one unit, the lower one on two.
        for found, expected in zip(scene["footprints"], (frame / 64 * 32, 0.99 * frame / 64 * 64)):
            self.assertAlmostEqual(found, expected, delta=0.01 * expected)
        (self.folder / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.fails(INVALID, "scene", "from-camera",
                   self.scene("cameras.json", surface={**mesh, "file": "bare.obj"}, image=[2, 2], cameras=[camera],
                              lights=[{"direction": [0, 0, 1]}]), "-o", self.path("x.json"), says="texture coordinates")

    def test_camera_mistakes(self):
        good = {"surface": {"kind": "plane", "size": [1, 1], "texels_per_unit": 1}, "image": [2, 2],
                "cameras": [{"position": [0, 0, 1], "look_at": [0, 0, 0], "fov": 30}], "lights": [{"direction": [0, 0, 1]}]}
        for says, change in (("'shape'", {"shape": 1}), ("'kind'", {"surface": {"kind": "cube"}}),
                             ("'lights'", {"lights": []}), ("'fov'", {"cameras": [{"position": [0, 0, 1], "look_at": [0, 0, 0]}]}),
                             ("'size'", {"surface": {"kind": "plane", "size": [1], "texels_per_unit": 1}}),
                             ("no pixel", {"cameras": [{"position": [0, 0, 1], "look_at": [0, 0, 2], "fov": 30}]}),
                             ("no light", {"lights": [{"direction": [0, 0, -1]}]})):
            self.fails(INVALID, "scene", "from-camera", self.scene("cameras.json", **{**good, **change}), "-o",
                       self.path("x.json"), says=says)


class TradeoffTest(CommandTest):
    """Settings against each other, curves in files, and what chooses by them; of a small BTF."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.set = str(cls.folder / "set.exr")
        done = run("synth", "btf:knit", "--size", "12x12", "-o", cls.set)
        assert done.returncode == 0, done.stderr

    def test_tradeoff(self):
        page, kept = Path(self.path("page.html")), Path(self.path("kept"))
        told = self.json("tradeoff", self.set, "--models", "ptm", "--device", "cpu", "-o", page, "--keep", kept, "--json")
        points = told["points"]
        self.assertEqual({p["model"] for p in points}, {"ptm"})
        self.assertEqual((told["pairs"], told["left_out"], told["no_time"]), (6561, [], []))
        # Without time the first setting alone; the others are named.
        hasty = self.json("tradeoff", self.set, "--models", "ptm", "--device", "cpu", "--minutes", "1e-6", "--json")
        first = points[0]["options"]
        self.assertEqual({p["options"] for p in hasty["points"]}, {first})
        self.assertEqual(set(hasty["no_time"]), {f"ptm {p['options']}" for p in points} - {f"ptm {first}"})
        self.assertGreater(len(hasty["no_time"]), 1)
        for p in points:
            self.assertEqual(p["judged_by"], "psnr_db")
            self.assertTrue(p["payload_bytes"] > 0 and p["cost"]["reads"] > 0)
            self.assertTrue(p["psnr_db"] > (5 if p["levels"] else 10))
        coded = [p for p in points if p["options"] == "--precision u8"]
        self.assertEqual([p["levels"] for p in coded], [0, 2, 1])
        self.assertEqual(len({p["file"] for p in coded}), 1)  # one fit shows all of them
        front = [points[i] for i in told["pareto"]["size"]]
        for a, b in zip(front, front[1:]):
            self.assertTrue(a["payload_bytes"] < b["payload_bytes"] and a["psnr_db"] < b["psnr_db"])
        for w in told["winners"]["bytes"]:
            under = [p for p in points if p["payload_bytes"] <= w["bytes"]]
            self.assertEqual(w["texels"] is None, not under)
            if under:  # what is as good within 0.05 dB is judged by its size
                good = [p for p in under if p["psnr_db"] >= max(q["psnr_db"] for q in under) - 0.05]
                self.assertEqual(points[w["texels"]]["payload_bytes"], min(p["payload_bytes"] for p in good))
        text = page.read_text()
        self.assertNotRegex(text, r"""(src|href)=["'](?!data:|#)|@import|url\(""")
        self.assertGreater(text.count("data:image/png;base64,"), 2)
        self.assertTrue(told["kept"])
        for path in told["kept"]:
            self.ok("verify", path)
            self.assertGreater(len(self.json("info", path, "--json")["quality"]["points"]), 1)
        self.fails(USAGE, "tradeoff", self.set, "--models", "patch", says="images")
        self.fails(USAGE, "tradeoff", self.image, "--models", "pca", says="data sets")
        self.fails(USAGE, "tradeoff", self.image, "--models", "velvet", says="velvet")

    def test_measured_curve(self):
        file, copy, out = self.path("pca.btfc"), self.path("copy.btfc"), self.path("out.png")
        made = self.json("encode", self.set, "-o", file, "--model", "pca", "--rank", "6", "--measure", "--json")
        points = made["quality"]["points"]
        self.assertEqual(self.json("info", file, "--json")["quality"]["points"], points)
        self.ok("copy", file, "-o", copy, "--codec", "raw")
        self.assertEqual(self.json("info", copy, "--json")["quality"]["points"], points)
        three = next(p for p in points if p["levels"] == 3)
        wanted = run("decode", file, "-o", out, "--psnr", three["psnr_db"] - 0.01)
        self.assertEqual(wanted.returncode, 0, wanted.stderr)
        chosen = Path(out).read_bytes()
        self.ok("decode", file, "-o", out, "--levels", "2")
        self.assertEqual(Path(out).read_bytes(), chosen)
        self.ok("decode", file, "-o", out, "--decode-cost", three["operations"])
        self.assertEqual(Path(out).read_bytes(), chosen)
        self.fails(USAGE, "decode", file, "-o", out, "--psnr", "150", says="best")
        self.fails(USAGE, "decode", file, "-o", out, "--decode-cost", "1", says="nearest")
        self.fails(USAGE, "decode", file, "-o", out, "--psnr", "20", "--levels", "1", says="--levels")
        self.fails(USAGE, "decode", file, "-o", out, "--gates", "2", says="gates")
        self.fails(USAGE, "decode", self.file, "-o", out, "--decode-cost", "500", says="no measured curve")

    def test_automatic_refusals(self):
        out = self.path("out.btfc")
        auto = ["encode", self.set, "-o", out, "--model", "auto"]
        self.fails(USAGE, *auto, says="--psnr")
        self.fails(USAGE, *auto, "--psnr", "30", "--bytes", "9", says="one of")
        self.fails(USAGE, *auto, "--psnr", "30", "--rank", "9", says="--rank")
        self.fails(USAGE, "encode", self.image, "-o", out, "--model", "auto", "--psnr", "30", says="texels in place")
        self.assertFalse(Path(out).exists())

    def automatic(self, source, out, *target):
        """What is told of a file whose model was chosen; why goes to standard error."""
        told = Path(self.path("told.json"))
        done = run("encode", source, "-o", out, "--model", "auto", *target, "--json", told)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"(?m)^fitted .* predicted .*\nchosen: ")
        return json.loads(told.read_text())

    @unittest.skipIf(os.environ.get("BTFC_SANITIZED"), "a dozen fits, minutes in a sanitized build")
    def test_automatic_choice(self):
        out = self.path("out.btfc")
        told = self.automatic(self.set, out, "--psnr", "30")
        auto = told["auto"]
        fit = auto["fits"][auto["chosen"]]
        self.assertEqual(fit["model"], told["model"])
        self.assertEqual(8 * fit["measured"]["payload_bytes"], told["payload_bits"])
        self.assertGreater(fit["measured"]["psnr_db"], 29.5)
        compared = json.loads(run("compare", self.set, out, "--measures", "psnr", "--json").stdout)
        self.assertAlmostEqual(fit["measured"]["psnr_db"], compared["psnr_db"], delta=0.3)
        # The smallest of those that are expected to reach it is tried first.
        good = [c for c in auto["candidates"] if c["predicted"]["psnr_db"] >= 30]
        self.assertEqual(min(c["predicted"]["payload_bytes"] for c in good), auto["candidates"][0]["predicted"]["payload_bytes"])
        self.ok("verify", out)

    @unittest.skipIf(os.environ.get("BTFC_SANITIZED"), "a dozen fits, minutes in a sanitized build")
    def test_automatic_choice_of_a_texture(self):
        texture, out = self.path("grain.png"), self.path("out.btfc")
        self.ok("synth", "grain", "--size", "64x64", "-o", texture)
        told = self.automatic(texture, out, "--bytes", "2000")
        self.assertTrue(0 < told["payload_bits"] <= 8 * 2000)
        within = [c["predicted"]["texture_distance"] for c in told["auto"]["candidates"] if c["predicted"]["payload_bytes"] <= 2000]
        self.assertLessEqual(told["auto"]["candidates"][0]["predicted"]["texture_distance"], min(within) + 0.01)
        self.fails(FAILED, "encode", texture, "-o", out, "--model", "auto", "--bytes", "16", says="no model reaches 16 bytes")


class RenderTest(CommandTest):
    """Pictures of lit shapes, where there is a Vulkan device with its validation layer."""

    RING = [(0, 0), (60, 0), (60, 90), (60, 180), (60, 270)]

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("decode", cls.file, "-o", cls.folder / "device.png", "--device", "vulkan", "--validation")
        if done.returncode == UNSUPPORTED:
            raise unittest.SkipTest(done.stderr.strip())
        assert done.returncode == 0, done.stderr

    def set_of(self, name, value, size=4, **more):
        """A data set of linear grey values: value(view, light), vectors, the same for all texels."""
        folder = self.folder / name
        folder.mkdir(exist_ok=True)
        images = []
        for a, view in enumerate(self.RING):
            for b, light in enumerate(self.RING):
                shown = value(btf_sets.vector_of(view), btf_sets.vector_of(light))
                btf_sets.write_image(folder / f"v{a}l{b}", size, size, 3, "unorm16", [shown] * (size * size * 3))
                images.append({"file": f"v{a}l{b}.png", "view": view, "light": light})
        path = folder / "set.json"
        path.write_text(json.dumps({"images": images, "colour_space": "lin_rec709_scene", **more}))
        return path

    def render(self, source, *args, side=33):
        """Linear red of the picture's texels, by (x, y); the validation layer has nothing to say."""
        size = [] if "--size" in args else ["--size", f"{side}x{side}"]
        self.ok("render", source, "-o", self.path("out.png"), "--validation", "--samples", "1", *size, *args)
        width, height, channels, bits, codes = files.read_png(self.path("out.png"))
        self.assertEqual((channels, bits), (3, 8))
        return lambda x, y: self.linear(codes[(y * width + x) * 3])

    @staticmethod
    def linear(code):
        v = code / 255
        return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4

    def test_shapes_and_models(self):
        for shape in ("sphere", "plane", "cloth", "swatch"):
            told = self.json("render", self.file, "-o", self.path("out.png"), "--shape", shape, "--size", "40x24",
                             "--validation", "--json")
            self.assertEqual((told["files"], told["shape"], told["lights"]), ([self.path("out.png")], shape, 1))
            self.assertEqual(files.read_png(self.path("out.png"))[:4], (40, 24, 3, 8))
            self.assertGreater(len(set(files.read_png(self.path("out.png"))[4])), 20)

    def test_fragments_are_what_the_decoder_gives(self):
        """A pixel a texel, head-on, for a file of each model."""
        vectors = Path(SOURCE) / "tests/vectors"
        for model in files.MODELS:
            path = vectors / model / ("liang_rgb8.btfc" if model == "patch" else "rgb8_f32.btfc")
            with self.subTest(model):
                self.ok("decode", path, "-o", self.path("texels.png"))
                width, height, channels, bits, codes = files.read_png(self.path("texels.png"))
                self.ok("render", path, "-o", self.path("out.png"), "--shape", "swatch", "--light", "0,0", "--samples", "1",
                        "--size", f"{width}x{height}", "--repeat", "1,1", "--validation")
                shown = files.read_png(self.path("out.png"))[4]
                self.assertLessEqual(max(abs(a - b) for a, b in zip(shown, codes)), 1)

    def test_sets_are_shown_without_loss(self):
        path = btf_sets.write_set(self.folder / "noise", btf_sets.RING, btf_sets.RING, (8, 6), seed=4)
        for light, name in (("0,0", "v0l0"), ("35,90", "v0l2"), ("35,180", "v0l3")):
            self.ok("render", path, "-o", self.path("out.png"), "--shape", "swatch", "--light", light, "--samples", "1",
                    "--size", "8x6", "--repeat", "1,1", "--validation")
            shown, wanted = files.read_png(self.path("out.png"))[4], files.read_png(path.parent / f"{name}.png")[4]
            self.assertLessEqual(max(abs(a - b) for a, b in zip(shown, wanted)), 1)
        self.ok("render", path, "--crop", "2,1,4,4", "-o", self.path("out.png"), "--size", "16x16")

    def test_cosines(self):
        """Values that have the light's cosine do not get it again, but below the lowest measured light."""
        for quantity, wanted in (("reflectance", {0: 0.5, 60: 0.25, 80: 0.5 * math.cos(math.radians(80))}),
                                 ("reflectance_cos", {0: 0.5, 60: 0.5, 80: math.cos(math.radians(80))}),
                                 ("unspecified", {0: 0.5, 60: 0.5, 80: math.cos(math.radians(80))})):
            path = self.set_of(quantity, lambda view, light: 0.5, quantity=quantity)
            for theta, value in wanted.items():
                for shape in ("sphere", "swatch") if theta == 60 else ("swatch",):
                    at = self.render(path, "--shape", shape, "--light", f"{theta},30")
                    self.assertAlmostEqual(at(16, 16), value, delta=0.02 * value + 0.002, msg=f"{quantity} {theta} {shape}")
        at = self.render(path, "--shape", "swatch", "--light", "0,0", "--light", "80,0", "--exposure", "-1")
        self.assertAlmostEqual(at(16, 16), 0.25 + math.cos(math.radians(80)) / 2, delta=0.01)
        # No directions: an albedo, in codes of sRGB. The shape's other side is dark.
        white = self.path("white.png")
        files.write_png(white, 32, 32, 1, 8, [188] * 1024)
        path = self.encode("white.btfc", "--k", "4", "--wb", "12", "--we", "4", image=white)
        at = self.render(path, "--light", "60,0")
        self.assertAlmostEqual(at(16, 16), self.linear(188) / 2, delta=0.01)
        self.assertGreater(at(26, 16), at(16, 16))
        self.assertEqual(self.render(path, "--light", "180,0")(16, 16), 0)
        self.assertEqual(self.render(path, "--light", "90,0")(6, 16), 0)

    def test_frames_of_light_and_view(self):
        """On a ball, lit from the viewer: both directions lean towards its middle."""
        for axis in (0, 1):
            for which in (0, 1):
                path = self.set_of(f"lean{axis}{which}", lambda *d: 0.5 + 0.5 * d[which][axis])
                at = self.render(path, "--light", "0,0")
                right, left, top, bottom = at(26, 16), at(6, 16), at(16, 6), at(16, 26)
                if axis == 0:
                    self.assertTrue(right < 0.35 < 0.65 < left and abs(top - bottom) < 0.05, (right, left, top, bottom))
                else:
                    self.assertTrue(top < 0.35 < 0.65 < bottom and abs(left - right) < 0.05, (right, left, top, bottom))
        # Lights that do not come from the viewer, on a square that faces it.
        for light, wanted in (("60,0", 0.5), ("60,90", 0.5 + 0.5 * math.sin(math.radians(60))), ("60,270", 0.0670)):
            at = self.render(self.set_of("lean", lambda view, light: 0.5 + 0.5 * light[1]), "--shape", "swatch", "--light", light)
            self.assertAlmostEqual(at(16, 16), wanted, delta=0.005)

    def test_environment(self):
        path = self.set_of("diffuse", lambda view, light: 0.5, quantity="reflectance")

        def hdr(name, radiance):
            pixels = bytes(b for _ in range(4) for x in range(7) for b in radiance(x))
            Path(self.path(name)).write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 7\n" + pixels)
            return self.path(name)

        at = self.render(path, "--shape", "swatch", "--env", hdr("one.hdr", lambda x: [128, 128, 128, 129]))
        self.assertAlmostEqual(at(16, 16), 0.5, delta=0.05)
        bright = [255, 255, 255, 128], [4, 4, 4, 122]
        at = self.render(path, "--env", hdr("left.hdr", lambda x: bright[x >= 3]), "--env-lights", "20")
        self.assertGreater(at(8, 16), 2 * at(24, 16))
        self.fails(3, "render", path, "-o", self.path("out.png"), "--env", hdr("dark.hdr", lambda x: [0] * 4), says="black")

    def test_turntable(self):
        out = self.path("turn.exr")
        told = self.json("render", self.file, "-o", out, "--turntable", "3", "--size", "16x16", "--json")
        names = [self.path(f"turn-{i:03}.exr") for i in range(3)]
        self.assertEqual(told["files"], names)
        self.assertFalse(Path(out).exists())
        self.ok("render", self.file, "-o", self.path("turn.png"), "--size", "16x16")
        first = json.loads(run("compare", self.path("turn.png"), names[0], "--json").stdout)
        self.assertGreater(first["psnr_db"], 48)
        turned = json.loads(run("compare", names[0], names[1], "--json").stdout)
        self.assertLess(turned["psnr_db"], 40)

    def test_refusals(self):
        def refuses(status, says, *args, source=None, out="out.png"):
            self.fails(status, "render", source or self.file, "-o", self.path(out), *args, says=says)
            self.assertFalse(Path(self.path(out)).exists())

        refuses(1, "cube", "--shape", "cube")
        for light in ("up", "30", "200,0", "1,2,3"):
            refuses(1, "--light", "--light", light)
        for size in ("0x5", "5", "5000x5000"):
            refuses(1, "--size", "--size", size)
        for repeat in ("0,1", "2", "-1,1", "nan,1"):
            refuses(1, "--repeat", "--repeat", repeat)
        refuses(1, "output format", out="out.jpg")
        refuses(1, "nope", "--map", "nope")
        refuses(1, "no data set", "--crop", "0,0,4,4")
        refuses(1, "for --env", "--env-lights", "5")
        refuses(2, "none.btfc", source=self.path("none.btfc"))
        refuses(3, "text.btfc", source=self.path("text.btfc"))
        refuses(2, "none.hdr", "--env", self.path("none.hdr"))
        car = Path(SOURCE) / "tests/vectors/car/image_rgb.btfc"
        refuses(5, "--repeat", "--repeat", "900,900", source=car)
        self.fails(2, "render", self.file, "-o", "/nowhere/out.png", says="/nowhere")


class TextureDistanceTest(CommandTest):
    def test_statistics(self):
        for name, seed in (("a", 1), ("b", 2)):
            self.ok("synth", "grain", "--size", "96x64", "--seed", seed, "-o", self.path(f"{name}.png"))
        told = self.json("compare", "--statistics", self.path("a.png"), self.path("b.png"), "--json")
        for measure in ("marginal_distance", "power_spectrum_distance", "autocorrelation_distance", "stsim2"):
            self.assertEqual(set(told["distances"][measure]), {"value", "ceiling", "ratio"})
            self.assertTrue(0.2 < told["distances"][measure]["ratio"] < 5, told)
        same = self.json("compare", "--statistics", self.path("a.png"), self.path("a.png"), "--json")
        self.assertEqual((same["flip"], same["mae_lab"]), (0, 0))
        # Two crops of 32 texels a side each way: four of the sixteen pairs are equal.
        for measure in ("marginal_distance", "power_spectrum_distance", "autocorrelation_distance", "stsim2"):
            self.assertAlmostEqual(same["distances"][measure]["ratio"], 0.75)
        said = self.ok("compare", "--statistics", self.path("a.png"), self.path("b.png"))
        self.assertIn("ratio", said)


if __name__ == "__main__":
    main()
