#!/usr/bin/env python3
"""Footprints of a file of model gm against box filters of its own decode, as a Markdown table; run by hand.

footprint_table.py --btfc PATH FILE.btfc…

For each footprint n: PSNR of `decode --footprint n` to the mean over n x n texels of `decode`, over 12 pairs of
directions; the same for what a decoder without footprints shows; and the time of a texel beside that of footprint 1.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import make_vectors as files

PAIRS = [(0, 0, 0, 0), (15, 40, 30, 200), (30, 120, 15, 10), (45, 0, 45, 180), (45, 90, 60, 45), (60, 270, 30, 90),
         (60, 30, 60, 210), (75, 0, 15, 90), (15, 90, 75, 0), (75, 180, 75, 0), (30, 300, 75, 120), (60, 45, 0, 0)]
FOOTPRINTS = (2, 4, 8, 16, 64)


def run(btfc, *arguments):
    done = subprocess.run([btfc, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"btfc {' '.join(map(str, arguments))}: {done.stderr}")
    return done.stdout


def decode(btfc, path, out, pair, footprint):
    run(btfc, "decode", path, "-o", out, "--view", f"{pair[0]},{pair[1]}", "--light", f"{pair[2]},{pair[3]}", "--footprint", footprint)
    width, height, channels, bits, codes = files.read_png(out)
    return np.reshape(codes, (height, width, channels)) / (2.0 ** bits - 1)


def along(values, n, axis, wraps):
    """Means over a box of n texels centred on each; an even box takes half of the texels at its ends."""
    reach, half = n // 2, n % 2 == 0
    weights = np.ones(2 * reach + 1)
    if half:
        weights[[0, -1]] = 0.5
    size, out = values.shape[axis], np.zeros_like(values)
    moved = np.moveaxis(values, axis, 0)
    to = np.moveaxis(out, axis, 0)
    for i in range(size):
        at = np.arange(i - reach, i + reach + 1)
        inside = np.ones(len(at), bool) if wraps else (at >= 0) & (at < size)
        w = weights[inside]
        to[i] = np.tensordot(w / w.sum(), moved[at[inside] % size], 1)
    return out


def psnr(squares):
    return -10 * np.log10(max(np.mean(squares), 1e-12))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--wraps", action="store_true", help="the tile repeats: boxes reach round it")
    parser.add_argument("files", nargs="+")
    args = parser.parse_args()
    print("| file | footprint | PSNR | without footprints | full image, cost | random texel, cost |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.png"
        for path in args.files:
            plain = [decode(args.btfc, path, out, pair, 1) for pair in PAIRS]
            base = json.loads(run(args.btfc, "bench", path, "--seconds", "0.5", "--json"))
            for n in FOOTPRINTS:
                filtered = [along(along(image, n, 0, args.wraps), n, 1, args.wraps) for image in plain]
                seen = [decode(args.btfc, path, out, pair, n) for pair in PAIRS]
                rate = json.loads(run(args.btfc, "bench", path, "--seconds", "0.5", "--footprint", n, "--json"))
                with_it = psnr([np.mean((a - b) ** 2) for a, b in zip(seen, filtered)])
                without = psnr([np.mean((a - b) ** 2) for a, b in zip(plain, filtered)])
                cost = [base[k] / rate[k] for k in ("cpu_full_mtexel_s", "cpu_random_mtexel_s")]
                print(f"| {Path(path).stem} | {n} | {with_it:.1f} | {without:.1f} | {cost[0]:.2f} | {cost[1]:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
