#!/usr/bin/env python3
"""How hard BTFs are: PSNR of their best approximations of rank k, beside the mean image; run by hand.

svd_ladder.py --btfc PATH SET…      SET: a directory named as UBO2003, or btf:<kind> for a synthetic one of 64x64

Samples are display codes of 8 bits, rows texels and channels, columns pairs; the mean image is taken off. The leading
singular subspace by block iteration until its energies change by less than 10^-5 of themselves, in single precision
with sums in double. Debian packages: python3-numpy python3-skimage.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
from skimage import io

RANKS = (1, 2, 4, 8, 16)


def ladder(folder):
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in (".png", ".jpg", ".jpeg"))
    if not files:
        sys.exit(f"{folder}: no images")
    matrix = numpy.stack([io.imread(f).reshape(-1) for f in files]).astype(numpy.float32)  # pairs x samples
    matrix -= matrix.mean(axis=0, dtype=numpy.float64).astype(numpy.float32)
    total = float(numpy.sum(numpy.square(matrix, dtype=numpy.float64)))
    block = numpy.random.default_rng(1).standard_normal((matrix.shape[1], RANKS[-1] + 8)).astype(numpy.float32)
    before = numpy.zeros(RANKS[-1])
    for _ in range(200):
        projected, _ = numpy.linalg.qr(matrix @ block)
        small = projected.T @ matrix
        values = numpy.linalg.svd(small.astype(numpy.float64), compute_uv=False)[:RANKS[-1]] ** 2
        block = small.T
        if numpy.all(numpy.abs(values - before) <= 1e-5 * values):
            break
        before = values
    left = [total - values[:k].sum() for k in (0, *RANKS)]
    return [10 * numpy.log10(255 ** 2 * matrix.size / energy) for energy in left]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--btfc", required=True)
    parser.add_argument("sets", nargs="+", metavar="SET")
    options = parser.parse_args()
    print("| set | mean image | " + " | ".join(f"k = {k}" for k in RANKS) + " |")
    print("|" + "---|" * (len(RANKS) + 2))
    for name in options.sets:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(name)
            if name.startswith("btf:"):
                folder = Path(temporary) / "set"
                subprocess.run([options.btfc, "synth", name, "-o", folder], check=True)
            print(f"| {name if name.startswith('btf:') else folder.name} | "
                  + " | ".join(f"{v:.1f}" for v in ladder(folder)) + " |", flush=True)


if __name__ == "__main__":
    main()
