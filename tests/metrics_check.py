#!/usr/bin/env python3
"""PSNR, SSIM, MAE in CIE Lab and FLIP of `btfc compare` beside independent ones; run by hand.

metrics_check.py --btfc PATH A B [A B ...]

A and B are 8-bit images of one size, grey or RGB. SSIM and Lab are those of scikit-image, FLIP is written out below in
two dimensions and doubles. Prints a line a pair: the command's value and its difference from the independent one.
Debian packages: python3-skimage python3-scipy python3-numpy.
"""

import argparse
import json
import math
import subprocess
import sys

import numpy as np
from scipy.ndimage import correlate
from skimage import io
from skimage.color import rgb2lab
from skimage.color.colorconv import xyz_from_rgb
from skimage.metrics import structural_similarity

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180
TO_XYZ = xyz_from_rgb / xyz_from_rgb.sum(axis=1, keepdims=True)  # over white


def rgb(path):
    image = io.imread(path)
    if image.ndim == 2:
        image = np.stack([image] * 3, axis=2)
    return image[:, :, :3].astype(float) / 255


def linear(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def lab(colour):
    xyz = colour @ TO_XYZ.T
    t = np.where(xyz > 216 / 24389, np.cbrt(xyz), 841 / 108 * xyz + 4 / 29)
    return np.stack([116 * t[..., 1] - 16, 500 * (t[..., 0] - t[..., 1]), 200 * (t[..., 1] - t[..., 2])], axis=-1)


def hunt(v):
    return np.concatenate([v[..., :1], 0.01 * v[..., :1] * v[..., 1:]], axis=-1)


def hyab(a, b):
    return np.abs(a[..., 0] - b[..., 0]) + np.hypot(a[..., 1] - b[..., 1], a[..., 2] - b[..., 2])


def kernel_sensitivity(terms):
    radius = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi ** 2)) * PIXELS_PER_DEGREE)
    y, x = np.mgrid[-radius:radius + 1, -radius:radius + 1] / PIXELS_PER_DEGREE
    k = sum(a * math.sqrt(math.pi / b) * np.exp(-math.pi ** 2 * (x * x + y * y) / b) for a, b in terms)
    return k / k.sum()


def kernel_feature(points):
    deviation = 0.5 * 0.082 * PIXELS_PER_DEGREE
    radius = math.ceil(3 * deviation)
    y, x = np.mgrid[-radius:radius + 1, -radius:radius + 1]
    k = np.exp(-(x * x + y * y) / (2 * deviation ** 2)) * ((x / deviation) ** 2 - 1 if points else -x)
    return np.where(k > 0, k / k[k > 0].sum(), k / -k[k < 0].sum())


def flip(a, b):
    sides = []
    kernels = [kernel_sensitivity(t) for t in ([(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)])]
    for image in (a, b):
        xyz = linear(image) @ TO_XYZ.T
        opponent = [116 * xyz[..., 1] - 16, 500 * (xyz[..., 0] - xyz[..., 1]), 200 * (xyz[..., 1] - xyz[..., 2])]
        y, cx, cz = [correlate(v, k, mode="nearest") for v, k in zip(opponent, kernels)]
        y = (y + 16) / 116
        seen = np.clip(np.stack([y + cx / 500, y, y - cz / 200], axis=-1) @ np.linalg.inv(TO_XYZ).T, 0, 1)
        features = [np.hypot(correlate(xyz[..., 1], k, mode="nearest"), correlate(xyz[..., 1], k.T, mode="nearest"))
                    for k in (kernel_feature(False), kernel_feature(True))]
        sides.append((hunt(lab(seen)), features))
    most = hyab(hunt(lab(np.array([0., 1, 0]))), hunt(lab(np.array([0., 0, 1])))) ** 0.7
    colour = hyab(sides[0][0], sides[1][0]) ** 0.7
    knee = 0.4 * most
    colour = np.where(colour < knee, 0.95 / knee * colour, 0.95 + (colour - knee) / (most - knee) * 0.05)
    feature = np.maximum(*[np.abs(p - q) for p, q in zip(sides[0][1], sides[1][1])])
    return np.mean(colour ** (1 - np.sqrt(feature / math.sqrt(2))))


def independent(path_a, path_b):
    a, b = rgb(path_a), rgb(path_b)
    grey = [v @ [0.299, 0.587, 0.114] for v in (a, b)]
    out = {"psnr_db": -10 * math.log10(np.mean((a - b) ** 2)) if (a != b).any() else math.inf}
    if min(grey[0].shape) >= 11:
        full = structural_similarity(*grey, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
                                     full=True)[1]
        out["ssim"] = full[5:-5, 5:-5].mean()  # the windows that lie inside
    out["mae_lab"] = np.abs(rgb2lab(a) - rgb2lab(b)).mean()
    out["flip"] = flip(a, b)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--btfc", required=True)
    parser.add_argument("images", nargs="+")
    arguments = parser.parse_args()
    if len(arguments.images) % 2:
        sys.exit("expected pairs of images")
    for a, b in zip(arguments.images[::2], arguments.images[1::2]):
        done = subprocess.run([arguments.btfc, "compare", a, b, "--json"], capture_output=True, text=True)
        if done.returncode not in (0, 7):
            sys.exit(done.stderr)
        ours = json.loads(done.stdout)
        texts = []
        for name, value in independent(a, b).items():
            got = ours.get(name)
            texts.append(f"{name} {got:.6f} ({got - value:+.1e})" if got is not None else f"{name} null ({value:.6f})")
        print(f"{a} {b}: " + "  ".join(texts))


if __name__ == "__main__":
    main()
