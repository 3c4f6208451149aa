#!/usr/bin/env python3
"""A table of textures made from automatically chosen samples: rates beside sharpness, spectrum and seams.

sample_table.py --btfc PATH --data DIR --out FILE.md [--samples 128,256] [--size 1024] [--only NAME,…]
                [--astc] [--tau T] [--tries N] [--wb N] [--we N] [--seed N] [--blend NAME] [--pictures FOLDER]

Each picture becomes a texture of --size a side by image quilting, from a sample of --sample auto. PSNR and SSIM are
over the common top left part; a synthesised texture is not aligned with it, they only show that these measures say
nothing here. With --pictures the decoded textures are kept. --astc adds what competes at these rates, the picture at
half resolution as ASTC 8x8 (0.50 bits), scaled up bilinearly. Nothing is judged; run by hand. Debian packages for
--astc: astcenc python3-skimage.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURES = {
    "bark": "textures_ambientcg/bark/albedo.jpg",
    "rock": "textures_ambientcg/rock/albedo.jpg",
    "factory_wall": "textures_polyhaven/factory_wall/factory_wall_diff_1k.jpg",
    "metal_plate_02": "textures_polyhaven/metal_plate_02/metal_plate_02_diff_1k.jpg",
    "marble": "textures_godot/marble_albedo.png",
    "bricks": "textures_godot/texture_bricks.jpg",
}
COLUMNS = ["picture", "sample", "window", "bit/texel (formula)", "bit/texel (file)", "gradient kept", "seam ratio",
           "spectrum distance", "PSNR dB", "SSIM", "sample used", "bits saved by trimming", "encode s"]
TARGET = 1.10  # of the seam ratio


class Command:
    def __init__(self, btfc):
        self.btfc = btfc

    def __call__(self, *args, allowed=(0,)):
        done = subprocess.run([self.btfc, *map(str, args)], capture_output=True, text=True)
        if done.returncode not in allowed:
            sys.exit(f"btfc {' '.join(map(str, args))}: exit code {done.returncode}\n{done.stderr}")
        return done.stdout

    def json(self, *args, **more):
        return json.loads(self(*args, "--json", **more))


def row_of(command, name, picture, side, options, more, folder):
    texture, trimmed, part = folder / "texture.btfc", folder / "trimmed.btfc", folder / "part.png"
    common = [picture, "--model", "patch", "--size", f"{options.size}x{options.size}", *more]
    made = command.json("encode", *common, "-o", texture, "--sample", "auto", "--sample-size", f"{side}x{side}")
    less = command.json("encode", *common, "-o", trimmed, "--sample", made["sample"], "--trim-sample")
    statistics = command.json("compare", picture, texture, "--statistics")

    # A picture that is smaller than the texture is held against the texture's top left part.
    width, height = (min(options.size, n) for n in (statistics["width"], statistics["height"]))
    command("decode", texture, "-o", part, "--region", f"0,0,{width},{height}")
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
        command("decode", texture, "-o", options.pictures / f"{name}_{side}.png")
    aligned = command.json("compare", picture, part, "--statistics")
    number = lambda value, digits: "-" if value is None else f"{value:.{digits}f}"
    seam = number(statistics["seam_ratio"], 3)
    saved = made["formula_bits"] - less["formula_bits"]
    return [name, f"{side}x{side}", made["sample"], number(made["bits_per_texel"], 4),
            number(made["bits_per_texel_file"], 4), number(statistics["gradient_kept"], 3),
            seam if statistics["seam_ratio"] <= TARGET else f"**{seam}**", number(statistics["spectrum_distance"], 3),
            number(aligned["psnr_db"], 2), number(aligned["ssim"], 3), f"{100 * made['sample_used']:.1f} %",
            f"{saved} ({100 * saved / made['formula_bits']:.1f} %)", number(made["seconds"], 2)]


def half_resolution(command, name, picture, folder):
    from skimage import io, transform
    import numpy
    whole = io.imread(picture)[..., :3] / 255
    height, width = (n // 2 for n in whole.shape[:2])
    whole = whole[:2 * height, :2 * width]
    paths = {key: folder / f"{key}.png" for key in ("whole", "half", "coded", "up")}
    save = lambda key, image: io.imsave(paths[key], numpy.round(255 * image).astype(numpy.uint8), check_contrast=False)
    save("whole", whole)
    save("half", whole.reshape(height, 2, width, 2, 3).mean((1, 3)))
    subprocess.run(["astcenc", "-tl", paths["half"], paths["coded"], "8x8", "-medium"], check=True,
                   stdout=subprocess.DEVNULL)
    coded = io.imread(paths["coded"])[..., :3] / 255
    save("up", transform.resize(coded, (2 * height, 2 * width), order=1, mode="edge", anti_aliasing=False))
    found = command.json("compare", paths["whole"], paths["up"], "--statistics")
    return [name, "ASTC 8x8 of half the resolution", "", "0.5000", "", f"{found['gradient_kept']:.3f}", "-",
            f"{found['spectrum_distance']:.3f}", f"{found['psnr_db']:.2f}", f"{found['ssim']:.3f}", "", "", ""]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--samples", default="128,256")
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--only", default=",".join(PICTURES))
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--astc", action="store_true")
    for name in ("tau", "wb", "we", "seed", "blend", "tries"):
        parser.add_argument("--" + name)
    options = parser.parse_args()
    more = [text for name in ("tau", "wb", "we", "seed", "blend", "tries") if (value := getattr(options, name)) is not None
            for text in ("--" + name, value)]
    command = Command(options.btfc)
    lines = [f"Settings: `{' '.join(more) or 'defaults'}`. Seam ratios above {TARGET:.2f} are bold.", "",
             "| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    with tempfile.TemporaryDirectory() as folder:
        for side in map(int, options.samples.split(",")):
            for name in options.only.split(","):
                row = row_of(command, name, options.data / PICTURES[name], side, options, more, Path(folder))
                lines.append("| " + " | ".join(row) + " |")
                print(lines[-1], flush=True)
        for name in options.only.split(",") if options.astc else []:
            row = half_resolution(command, name, options.data / PICTURES[name], Path(folder))
            lines.append("| " + " | ".join(row) + " |")
            print(lines[-1], flush=True)
    options.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
