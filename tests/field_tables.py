#!/usr/bin/python3
"""Tables and pictures of models car, gmrf and car3d, from data sets and textures.

field_tables.py --btfc PATH --out DIR WHAT INPUT…   with WHAT one of
  materials   BTFs or images: bytes of parameters, range map and index, ratio, seconds, stability, mean BRDF error
  textures    images: distances between synthesis and original beside those between crops of the original, for the
              three models, with and without marginal tables, and for the paper's Laplacian bands
  missing     BTF directories as of UBO2003: a fit on 50 %, 10 % and one of the pairs, measured on the others
  pictures    BTFs or images: one PNG each, the original above the synthesis (BTFs: at eight pairs of directions),
              and the synthesis at four times the size
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from make_vectors import read_png, write_png  # noqa: E402

MODELS = ("car", "gmrf", "car3d")


class Command:
    def __init__(self, path):
        self.path = path

    def run(self, *arguments, codes=(0, 7)):
        done = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode not in codes:
            sys.exit(f"btfc {' '.join(map(str, arguments))}: {done.stderr.strip()}")
        return done.stdout

    def json(self, *arguments, **how):
        return json.loads(self.run(*arguments, "--json", **how))

    def encode(self, source, out, model, *options):
        return self.json("encode", source, "-o", out, "--model", model, *options)


def is_image(path):
    return Path(path).suffix.lower() in (".png", ".jpg", ".jpeg", ".exr", ".tif", ".hdr")


def name_of(path):
    path = Path(path)
    return f"{path.parent.name}_{path.stem}" if is_image(path) else path.name


def chunk_bytes(info, *types):
    return sum(c["raw_bytes"] for c in info["chunks"] if c["type"] in types)


def materials(command, inputs, out, options):
    print("| material | model | c | file | parameters | range map | index | ratio | analysis s | models | unstable | after "
          "| shrunk | least rho | nats lost | BRDF rmse | colours |")
    print("|---" * 17 + "|")
    for source in inputs:
        for model in MODELS:
            file = out / f"{name_of(source)}.{model}.btfc"
            own = [] if is_image(source) else options
            fit = command.encode(source, file, model, *own)
            info = command.json("info", file)
            brdf = colours = ""
            if not is_image(source):
                measured = command.json("compare", source, file, "--measures", "mae_lab")
                brdf, colours = f"{measured['brdf_rmse_8bit']:.2f}", f"{measured['colour_distance']:.3f}"
            print(f"| {name_of(source)} | {model} | {fit['clusters']} | {fit['file_bytes']} | "
                  f"{chunk_bytes(info, 'PARM', 'SUBS', 'FLDS')} | {chunk_bytes(info, 'RMAP')} | {chunk_bytes(info, 'SIDX')} | "
                  f"{info['ratio_u8']:.0f} | {fit['seconds'] - fit['read_seconds']:.1f} | {fit['models']} | {fit['unstable']} | "
                  f"{fit['unstable_after_repair']} | {fit['shrunk']} | {fit['least_shrink']} | {fit['likelihood_lost']} | "
                  f"{brdf} | {colours} |", flush=True)


def textures(command, inputs, out, options):
    print("| texture | model | tables | bands | marginal | ratio | spectrum | ratio | autocorrelation | ratio | STSIM-2 | crops |")
    print("|---" * 12 + "|")
    for source in inputs:
        for model in MODELS:
            for knots, bands in ((16, "power"), (0, "power"), (16, "laplacian")):
                file, image = out / "t.btfc", out / "t.png"
                command.encode(source, file, model, "--knots", knots, "--bands", bands, *options)
                command.run("decode", file, "-o", image, "--size", "512x512")
                d = command.json("compare", source, image, "--statistics")["distances"]
                cells = [f"{d[key]['value']:.4f} | {d[key]['ratio']:.2f}"
                         for key in ("marginal_distance", "power_spectrum_distance", "autocorrelation_distance")]
                print(f"| {name_of(source)} | {model} | {'yes' if knots else 'no'} | {bands} | {' | '.join(cells)} | "
                      f"{d['stsim2']['value']:.4f} | {d['stsim2']['ceiling']:.4f} |", flush=True)


def linked(images, to):
    """A directory with links to some of a data set's images."""
    to.mkdir(parents=True, exist_ok=True)
    for image in images:
        (to / image.name).symlink_to(image.resolve())
    return to


def missing(command, inputs, out, options):
    print("| material | share | measured | model | BRDF rmse of the others | of the nearest light's | colours | of the nearest light's |")
    print("|---" * 8 + "|")
    for source in inputs:
        images = sorted(p for p in Path(source).rglob("*") if is_image(p))
        random.Random(1).shuffle(images)
        for share in (0.5, 0.1, 0.0):
            count = max(1, round(share * len(images)))
            with tempfile.TemporaryDirectory(dir=out) as scratch:
                kept = linked(images[:count], Path(scratch) / "kept")
                others = linked(images[count:], Path(scratch) / "others")
                row = {}
                for how in ("model", "skip"):
                    file = out / f"missing_{how}.btfc"
                    command.encode(kept, file, "car", "--missing", how, *options)
                    row[how] = command.json("compare", others, file, "--missing", "skip", "--resample", "--measures", "mae_lab")
                m, s = row["model"], row["skip"]
                print(f"| {name_of(source)} | {share:.0%} | {count} | car | {m['brdf_rmse_8bit']:.2f} | {s['brdf_rmse_8bit']:.2f} | "
                      f"{m['colour_distance']:.3f} | {s['colour_distance']:.3f} |", flush=True)


def stacked(pictures):
    """Pictures of 8 bits below one another, of one width at least: (width, height, codes) of RGB."""
    width = max(p[0] for p in pictures)
    rows = bytearray()
    for own, height, channels, _, codes in pictures:
        for y in range(height):
            row = codes[y * own * channels:(y + 1) * own * channels]
            if channels == 1:
                row = [v for v in row for _ in range(3)]
            rows += bytes(row) + b"\xff" * (3 * (width - own))
        rows += b"\xff" * (3 * width * 4)
    return width, len(rows) // (3 * width), bytes(rows)


def pictures(command, inputs, out, options):
    for source in inputs:
        for model in MODELS:
            file, base = out / "p.btfc", out / f"{name_of(source)}.{model}"
            own = [] if is_image(source) else options
            command.encode(source, file, model, *own)
            info = command.json("info", file)
            parts = []
            size = f"{2 * info['width']}x{2 * info['height']}"
            if is_image(source):
                command.run("decode", file, "-o", out / "p.png")
                command.run("decode", file, "-o", out / "q.png", "--size", size)
                if Path(source).suffix.lower() == ".png":
                    parts.append(read_png(source))
                parts += [read_png(out / "p.png"), read_png(out / "q.png")]
            else:
                command.run("compare", source, file, "--measures", "psnr", "--sheet", out / "p.png")
                parts.append(read_png(out / "p.png"))
                for light in ("0,0", "45,90"):
                    command.run("decode", file, "-o", out / "q.png", "--size", size, "--view", "0,0", "--light", light)
                    parts.append(read_png(out / "q.png"))
            width, height, codes = stacked(parts)
            write_png(f"{base}.png", width, height, 3, 8, codes)
            print(f"{base}.png", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--options", default="", help="more options of encode, separated by spaces")
    parser.add_argument("what", choices=("materials", "textures", "missing", "pictures"))
    parser.add_argument("inputs", nargs="+")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    globals()[a.what](Command(a.btfc), a.inputs, a.out, a.options.split())


if __name__ == "__main__":
    main()
