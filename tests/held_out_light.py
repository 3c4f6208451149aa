#!/usr/bin/env python3
"""How well model ptm relights from a light that it has not seen: each light held out in turn, PSNR inside the mask.

held_out_light.py --btfc PATH DIRECTORY…   photographs (PNG) of one object with a mask and a table of lights, here or above

The file is fitted to all other lights and evaluated at the one held out; errors are pooled over the mask's texels and
channels, values clamped to 0 … 1. Takes what is stored as it is, with no intensities of lights divided out.
"""

import argparse
import math
import re
import subprocess
import tempfile
from pathlib import Path

import numpy

from make_vectors import read_png

NAMES = "light_directions.txt", "lights.txt"


def lights_of(folder):
    path = next(p for where in (folder, folder.parent) for name in NAMES if (p := where / name).is_file())
    rows = [[float(word) for word in line.split()] for line in path.read_text().splitlines() if line.strip()]
    if len(rows[0]) == 1:
        rows = rows[1:]
    if len(rows) == 3 and len(rows[0]) != 3:
        rows = list(map(list, zip(*rows)))
    return rows


def photographs_of(folder):
    files = [p for p in folder.iterdir() if p.suffix.lower() == ".png"]
    masks = [p for p in files if "mask" in p.stem.lower()]
    shots = sorted((p for p in files if p not in masks),
                   key=lambda p: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", p.stem)])
    return shots, masks


def values(path):
    width, height, channels, bits, codes = read_png(path)
    return numpy.array(codes, dtype=numpy.float64).reshape(height, width, channels) / (2 ** bits - 1)


def held_out(btfc, shots, lights, mask, folder, which, options):
    work = Path(folder, str(which))
    work.mkdir()
    for i, shot in enumerate(shots):
        if i != which:
            (work / shot.name).symlink_to(shot.resolve())
    lines = [f"{len(shots) - 1}"] + [f"{shots[i].name} {x} {y} {z}" for i, (x, y, z) in enumerate(lights) if i != which]
    (work / "lights.lp").write_text("\n".join(lines) + "\n")
    file, image = work / "fit.btfc", work / "relit.png"
    subprocess.run([btfc, "encode", work / "lights.lp", "-o", file, "--model", "ptm", "--level", "1", *options], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    x, y, z = lights[which]
    theta = math.degrees(math.acos(z / math.sqrt(x * x + y * y + z * z)))
    angles = f"{theta:.9f},{math.degrees(math.atan2(y, x)):.9f}"
    subprocess.run([btfc, "decode", file, "-o", image, "--light", angles], check=True)
    error = (values(image) - values(shots[which]))[mask]
    return 10 * math.log10(1 / max(float((error ** 2).mean()), 1e-12))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--precision", default="f32")
    parser.add_argument("directories", nargs="+", type=Path)
    args = parser.parse_args()
    for folder in args.directories:
        shots, masks = photographs_of(folder)
        lights = lights_of(folder)
        if len(shots) != len(lights):
            raise SystemExit(f"{folder}: {len(shots)} photographs and {len(lights)} lights")
        mask = values(masks[0])[:, :, 0] > 0.5 if masks else numpy.ones(values(shots[0]).shape[:2], bool)
        with tempfile.TemporaryDirectory() as work:
            psnr = [held_out(args.btfc, shots, lights, mask, work, i, ["--precision", args.precision])
                    for i in range(len(shots))]
        worst = min(range(len(psnr)), key=psnr.__getitem__)
        print(f"{folder.name:32} {len(shots):3} lights, {int(mask.sum()):7} texels: mean {sum(psnr) / len(psnr):.2f} dB, "
              f"worst {psnr[worst]:.2f} dB (light {worst + 1}, {shots[worst].name})")


if __name__ == "__main__":
    main()
