#!/usr/bin/env python3
"""UBO2014 files of an independent writer, decoded and compared with the values it computed.

ubo2014_test.py --dump PATH [--source DIR] [unittest arguments]

The writer, make_ubo2014.py, is looked for in ../shared/tools beside the sources, or in ../tools beside $BTFC_DATA.
"""

import argparse
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

DUMP, SOURCE = None, Path(__file__).resolve().parent.parent


def writer():
    shared = Path(os.environ["BTFC_DATA"]).resolve().parent if "BTFC_DATA" in os.environ else SOURCE.parent / "shared"
    return shared / "tools" / "make_ubo2014.py"


class Ubo2014Test(unittest.TestCase):
    def decode(self, folder, options, *crop):
        btf, values = Path(folder, "t.btf"), Path(folder, "t.json")
        args = [str(v) for option in options.items() for v in option]
        subprocess.run([sys.executable, writer(), btf, values, *args], check=True, stdout=subprocess.DEVNULL)
        done = subprocess.run([DUMP, btf, *map(str, crop)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(values.read_text()), json.loads(done.stdout)

    def setUp(self):
        if not writer().is_file():
            self.skipTest(f"no writer: {writer()} does not exist, set BTFC_DATA")

    def check_values(self, expected, got):
        """Largest absolute and relative difference; each within half's rounding and that of single precision sums."""
        worst, worst_relative = 0.0, 0.0
        self.assertEqual(len(got), len(expected))
        for e, g in zip(expected, got):
            difference = abs(g - e)
            self.assertLessEqual(difference, abs(e) * 2**-11 + 2**-25 + 1e-6 * max(1.0, abs(e)))
            worst = max(worst, difference)
            if abs(e) > 1e-3:
                worst_relative = max(worst_relative, difference / abs(e))
        return worst, worst_relative

    def test_all_options(self):
        worst, worst_relative, worst_angle, count = 0.0, 0.0, 0.0, 0
        with tempfile.TemporaryDirectory() as folder:
            shapes = [("6x4", 5, 4, 3), ("1x1", 1, 1, 1), ("5x7", 7, 5, 40), ("33x9", 3, 12, 17)]
            for shape, scalar, model, cosine in itertools.product(shapes, ["half", "float"], [0, 1, 4, 11], [0, 1]):
                size, lights, views, components = shape
                options = {"--size": size, "--lights": lights, "--views": views, "--components": components,
                           "--scalar": scalar, "--model": model, "--cosine": cosine, "--seed": count + 1}
                with self.subTest(str(options)):
                    want, got = self.decode(folder, options)
                    self.assertEqual((got["kind"], got["type"]), ("ubo2014", "float16"))
                    self.assertEqual((got["width"], got["height"]), (want["width"], want["height"]))
                    self.assertEqual(got["channels"], ["R", "G", "B"])
                    self.assertEqual(got["colour_space"], "lin_rec709_scene")
                    self.assertEqual(got["quantity"], "reflectance_cos" if cosine else "reflectance")
                    self.assertEqual(got["pairs"], [[v, l] for v in range(views) for l in range(lights)])
                    for given, read in zip(want["views"] + want["lights"], got["views"] + got["lights"]):
                        turn = math.remainder(given[1] - read[1], 2 * math.pi)
                        worst_angle = max(worst_angle, abs(given[0] - read[0]), abs(turn))
                    self.assertLess(worst_angle, 4e-7)  # single precision in the file
                    a, r = self.check_values([c for rgb in want["values"] for c in rgb], got["values"])
                    worst, worst_relative, count = max(worst, a), max(worst_relative, r), count + 1
        print(f"\n{count} option combinations: largest difference {worst:.3g}, relative {worst_relative:.3g} "
              f"(half's rounding is {2**-11:.3g}), angles {worst_angle:.3g} rad", file=sys.stderr)

    def test_crop(self):
        with tempfile.TemporaryDirectory() as folder:
            options = {"--size": "9x6", "--lights": 4, "--views": 3}
            want, got = self.decode(folder, options, 2, 1, 5, 3)
            self.assertEqual((got["width"], got["height"]), (5, 3))
            expected = [c for pair in range(12) for y in range(1, 4) for x in range(2, 7)
                        for c in want["values"][(pair * 6 + y) * 9 + x]]
            self.check_values(expected, got["values"])


def main():
    global DUMP, SOURCE
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--dump", required=True)
    parser.add_argument("--source", type=Path, default=SOURCE)
    args, rest = parser.parse_known_args()
    DUMP, SOURCE = str(Path(args.dump).resolve()), args.source.resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)


if __name__ == "__main__":
    main()
