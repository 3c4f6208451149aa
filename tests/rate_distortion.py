#!/usr/bin/env python3
"""PSNR at equal bytes of payload: gm against pca and lpca at u8, as a Markdown table and a plot; run by hand.

rate_distortion.py --btfc PATH [--bytes 8192,16384,32768,65536] [--plot OUT.svg] SET…    SET: what `btfc encode` takes

Of pca and lpca the settings are tried whose payload fits and takes at least a third of the bytes; a dash: none does.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

COLOURS = {"gm": "#c0392b", "pca": "#2471a3", "lpca": "#1e8449"}
DASHES = ("", "6,3", "2,3", "8,3,2,3")


def run(btfc, *arguments):
    done = subprocess.run([btfc, *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 7):
        sys.exit(f"btfc {' '.join(map(str, arguments))}: {done.stderr}")
    return json.loads(done.stdout)


def candidates(model, size, bytes_):
    """Options whose payload fits, the largest first."""
    ranks = [("--rank", k) for k in range(64)]
    tried = ranks if model == "pca" else [("--clusters", c, "--rank", k) for c in range(1, 13) for k in range(0, 24)]
    fitting = []
    for options in tried:
        said = subprocess.run([*size, "--model", model, "--precision", "u8", *map(str, options), "--json"],
                              capture_output=True, text=True)
        taken = json.loads(said.stdout)["formula_bits"] / 8 if said.returncode == 0 else math.inf
        if bytes_ / 3 <= taken <= bytes_:
            fitting.append((taken, options))
        if model == "pca" and taken > bytes_:
            break
    return [options for _, options in sorted(fitting, reverse=True)]


def best(btfc, source, folder, model, size, bytes_):
    if model == "gm":
        return run(btfc, "encode", source, "-o", folder / "x.btfc", "--model", "gm", "--bytes", bytes_)["psnr_db"]
    found = None
    for options in candidates(model, size, bytes_)[:4]:
        run(btfc, "encode", source, "-o", folder / "x.btfc", "--model", model, "--precision", "u8", *options)
        psnr = run(btfc, "compare", source, folder / "x.btfc", "--measures", "psnr")["psnr_db"]
        found = psnr if found is None else max(found, psnr)
    return found


def plot(path, table, rates):
    """table[set, model] -> PSNR at each rate, or None."""
    values = [v for row in table.values() for v in row if v is not None]
    low, high = math.floor(min(values)), math.ceil(max(values))
    x = {r: 60 + 480 * i / max(1, len(rates) - 1) for i, r in enumerate(rates)}
    sets = sorted({s for s, _ in table})
    lines = ['<svg xmlns="http://www.w3.org/2000/svg" width="720" height="420" font-family="sans-serif" font-size="12">',
             '<rect width="720" height="420" fill="white"/>']
    for v in range(low, high + 1):
        y = 380 - 350 * (v - low) / (high - low)
        lines.append(f'<path d="M60 {y:.1f}H540" stroke="#ddd"/><text x="52" y="{y + 4:.1f}" text-anchor="end">{v}</text>')
    lines += [f'<text x="{x[r]:.1f}" y="398" text-anchor="middle">{r / 1024:g} KB</text>' for r in rates]
    lines.append('<text x="60" y="18">PSNR, dB, over bytes of payload</text>')
    for (source, model), row in table.items():
        points = [f"{x[r]:.1f},{380 - 350 * (v - low) / (high - low):.1f}" for r, v in zip(rates, row) if v is not None]
        dash = DASHES[sets.index(source) % len(DASHES)]
        lines.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{COLOURS[model]}" stroke-dasharray="{dash}"/>')
        lines += [f'<circle cx="{p.split(",")[0]}" cy="{p.split(",")[1]}" r="3" fill="{COLOURS[model]}"/>' for p in points]
    for i, (source, model) in enumerate(table):
        dash = DASHES[sets.index(source) % len(DASHES)]
        lines.append(f'<path d="M560 {40 + 18 * i}h28" stroke="{COLOURS[model]}" stroke-dasharray="{dash}"/>'
                     f'<text x="594" y="{44 + 18 * i}">{model} {source}</text>')
    Path(path).write_text("\n".join(lines + ["</svg>"]) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--bytes", default="8192,16384,32768,65536")
    parser.add_argument("--plot")
    parser.add_argument("sets", nargs="+")
    args = parser.parse_args()
    rates, table = [int(b) for b in args.bytes.split(",")], {}
    print("| set | model | " + " | ".join(f"{r:,}" for r in rates) + " |\n|---|---|" + "---|" * len(rates))
    with tempfile.TemporaryDirectory() as folder:
        for source in args.sets:
            described = run(args.btfc, "convert", source, "-o", Path(folder) / "set.exr")
            pairs = [] if described["full_product"] else ["--pairs", described["pairs"]]
            size = [args.btfc, "size", "--size", f"{described['width']}x{described['height']}", "--views", str(described["views"]),
                    "--lights", str(described["lights"]), "--channels", str(described["channels"]), *map(str, pairs)]
            for model in COLOURS:
                row = [best(args.btfc, Path(folder) / "set.exr", Path(folder), model, size, r) for r in rates]
                table[Path(source).name, model] = row
                print(f"| {Path(source).name} | {model} | " + " | ".join("—" if v is None else f"{v:.2f}" for v in row) + " |",
                      flush=True)
    if args.plot:
        plot(args.plot, table, rates)
    return 0


if __name__ == "__main__":
    sys.exit(main())
