#!/usr/bin/env python3
"""What a scene saves on a measured set: bytes, PSNR over the scene's domain and seconds, unrestricted beside restricted.

scene_table.py --btfc PATH SET... [--out DIR] [--only lpca,gm,car] [--time-limit S]

SET is a directory named as UBO2003 of 81 x 81 directions. Scene 1: views up to 30 degrees and three lights. Scene 2:
views up to 60 degrees and all lights. Run by hand; prints Markdown; files are kept in --out and made once.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENES = {
    "1": {"views": {"theta": [0, 30]}, "lights": {"list": [[0, 0], [45, 100], [60, 216]]}},
    "2": {"views": {"theta": [0, 60]}},
}
GM_BYTES = 24576


class Table:
    def __init__(self, btfc, source, out, limit):
        self.btfc, self.source, self.out, self.limit = btfc, source, out, limit
        for name, scene in SCENES.items():
            (out / f"scene{name}.json").write_text(json.dumps(scene))

    def run(self, *args):
        done = subprocess.run(["nice", self.btfc, *map(str, args)], capture_output=True, text=True)
        if done.returncode not in (0, 7):
            sys.exit(f"{' '.join(map(str, args))}: {done.stderr}")
        return done.stdout

    def encode(self, name, *options, scene=None):
        """A file, made where it is not there yet, and what encode said of it."""
        path, said = self.out / f"{name}.btfc", self.out / f"{name}.json"
        if not said.exists():
            extra = ["--scene", self.out / f"scene{scene}.json"] if scene else []
            self.run("encode", self.source, "-o", path, *options, *extra, "--json", said)
        return path, json.loads(said.read_text())

    def compare(self, path, scene, measures="psnr"):
        return json.loads(self.run("compare", self.source, path, "--scene", self.out / f"scene{scene}.json",
                                   "--measures", measures, "--json"))

    def row(self, what, path, said, scene, measured=None):
        m = measured or self.compare(path, scene)
        print(f"| {what} | {scene} | {said['payload_bits'] // 8:,} | {said['file_bytes']:,} | {m['psnr_db']:.2f} | "
              f"{m['brdf_rmse_8bit']:.2f} | {said['seconds'] - said['read_seconds']:.1f} | {said['seconds']:.1f} |", flush=True)
        return m["psnr_db"]

    def head(self, title):
        print(f"\n### {self.source.name}: {title}\n\n| file | scene | payload | file bytes | PSNR dB | mean BRDF rmse | fit s | "
              "encode s |\n|---|---|---|---|---|---|---|---|", flush=True)

    def smallest(self, scene, wanted, name, points):
        """The first of growing option lists whose PSNR over the scene is the wanted one."""
        for label, options in points:
            path, said = self.encode(f"{name}-{label}", *options, scene=scene)
            psnr = self.row(f"{name}-{label} restricted", path, said, scene)
            if psnr >= wanted:
                return said
        return None

    def verdict(self, what, said, whole):
        if said is None:
            print(f"\n{what}: no restricted file came to the PSNR.\n")
            return
        print(f"\n{what}: {said['payload_bits'] / whole['payload_bits']:.4f} of the payload, "
              f"{said['file_bytes'] / whole['file_bytes']:.4f} of the file, "
              f"{said['seconds'] / whole['seconds']:.4f} of the encode time.\n", flush=True)

    def lpca(self):
        options = ["--model", "lpca", "--precision", "u8", "--clusters", "8"]
        whole_path, whole = self.encode("lpca", *options, "--rank", "8")
        for scene in SCENES:
            self.head(f"lpca 8 x 8 u8, scene {scene}")
            wanted = self.row("lpca unrestricted", whole_path, whole, scene)
            # From a single cluster on: few pairs are explained by few components.
            points = [(f"{k}x{n}", ["--model", "lpca", "--precision", "u8", "--clusters", k, "--rank", n])
                      for k, n in (((1, 1), (1, 2), (1, 3), (1, 4), (1, 6), (2, 4), (4, 4), (4, 6), (8, 6), (8, 7), (8, 8))
                                   if scene == "1" else ((8, 4), (8, 5), (8, 6), (8, 7), (8, 8)))]
            self.verdict(f"lpca, scene {scene}, at the unrestricted file's PSNR",
                         self.smallest(scene, wanted, f"lpca-s{scene}", points), whole)

    def gm(self):
        def options(size):
            return ["--model", "gm", "--bytes", size, "--time-limit", self.limit]
        whole_path, whole = self.encode("gm", *options(GM_BYTES))
        for scene in SCENES:
            self.head(f"gm {GM_BYTES} bytes, scene {scene}")
            wanted = self.row("gm unrestricted", whole_path, whole, scene)
            path, said = self.encode(f"gm-s{scene}-same", *options(GM_BYTES), scene=scene)
            gain = self.row("gm restricted, as many bytes", path, said, scene) - wanted
            sizes = (2048, 3072, 4096, 6144, 8192, 12288) if scene == "1" else (12288, 18432, 21504)
            found = self.smallest(scene, wanted, f"gm-s{scene}", [(size, options(size)) for size in sizes])
            print(f"\ngm, scene {scene}, at as many bytes: {gain:+.2f} dB.")
            self.verdict(f"gm, scene {scene}, at the unrestricted file's PSNR", found, whole)

    def car(self):
        options = ["--model", "car"]
        whole_path, whole = self.encode("car", *options)
        for scene in SCENES:
            self.head(f"car, scene {scene}")
            same = self.encode(f"car-s{scene}-same", *options, "--clusters", whole["clusters"], scene=scene)
            for what, (path, said) in (("unrestricted", (whole_path, whole)),
                                       ("restricted", self.encode(f"car-s{scene}", *options, scene=scene)),
                                       ("restricted, as many subspaces", same)):
                m = self.compare(path, scene, "mae_lab")
                self.row(f"car {what}", path, said, scene, m)
                print(f"| colour distance {m['colour_distance']:.4f}, spectrum distance "
                      f"{self.spectrum(path, SCENES[scene]):.4f} | | | | | | | |", flush=True)

    def spectrum(self, path, scene):
        """Mean distance of power spectra over up to 24 images of the domain."""
        most = scene["views"]["theta"][1]
        lights = scene.get("lights", {}).get("list")
        images = []
        for image in sorted(self.source.glob("*/*tl*")):
            numbers = dict((part[:2], int(part[2:])) for part in image.stem.split() if part[:2] in ("tl", "pl", "tv", "pv"))
            if numbers["tv"] <= most and (lights is None or [numbers["tl"], numbers["pl"]] in lights):
                images.append((image, numbers))
        step = max(1, len(images) // 24)
        sums, count = 0.0, 0
        for image, n in images[::step]:
            out = self.out / "one.png"
            self.run("decode", path, "-o", out, "--view", f"{n['tv']},{n['pv']}", "--light", f"{n['tl']},{n['pl']}")
            sums += json.loads(self.run("compare", image, out, "--statistics", "--measures", "psnr", "--json"))["spectrum_distance"]
            count += 1
        return sums / count


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "scene_table")
    parser.add_argument("--only", default="lpca,gm,car")
    parser.add_argument("--time-limit", default="120")
    parser.add_argument("sets", nargs="+", type=Path)
    args = parser.parse_args()
    begin = time.monotonic()
    for source in args.sets:
        out = args.out / source.name
        out.mkdir(parents=True, exist_ok=True)
        table = Table(args.btfc, source, out, args.time_limit)
        for model in args.only.split(","):
            getattr(table, model)()
    print(f"\n{time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    main()
