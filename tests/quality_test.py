#!/usr/bin/env python3
"""Size and quality of every model on generated material, held against tests/quality.csv.

quality_test.py --btfc PATH [--csv FILE] [--write]

A payload may not change and a PSNR not fall by more than 0.02 dB (of gm 0.2) without a change of the table; --write makes it anew.
The models of random fields synthesise texels of their own, which a PSNR says nothing about: of an image made of them the distance
of the autocorrelation (`compare --statistics`) may not grow by more than 0.02, and of a BTF the size alone counts.
Every model of `btfc models` must have a row.
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

COLUMNS = ("model", "material", "options", "payload_bits", "psnr_db", "autocorrelation")
LEAST = 0.02  # dB
MOST = 0.02  # of a distance
FIELDS = ("car", "gmrf", "car3d")
LEAST_OF = {"gm": 0.2}  # a descent goes its own way on each kind of processor
MATERIALS = {  # name: arguments of `btfc synth`
    "grain": ["grain", "-o", "{}.png", "--size", "128x128"],
    "tiles": ["tiles", "-o", "{}.png", "--size", "64x64"],
    "knit": ["btf:knit", "-o", "{}", "--size", "20x20"],
}


def run(btfc, *arguments):
    done = subprocess.run([btfc, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in (0, 7):
        sys.exit(f"btfc {' '.join(map(str, arguments))}: {done.stderr}")
    return done.stdout


def material(btfc, folder, name):
    arguments = [a.format(folder / name) for a in MATERIALS[name]]
    path = Path(arguments[2])
    if not path.exists():
        run(btfc, "synth", *arguments)
    return path


def measure(btfc, folder, row):
    source, out = material(btfc, folder, row["material"]), folder / "out.btfc"
    said = json.loads(run(btfc, "encode", source, "-o", out, "--model", row["model"], *row["options"].split(), "--json"))
    if row["model"] not in FIELDS:
        compared = json.loads(run(btfc, "compare", source, out, "--measures", "psnr", "--json"))
        return said["payload_bits"], f"{compared['psnr_db']:.3f}", ""
    if source.is_dir():
        return said["payload_bits"], "", ""
    compared = json.loads(run(btfc, "compare", source, out, "--statistics", "--json"))
    return said["payload_bits"], "", f"{compared['distances']['autocorrelation_distance']['value']:.3f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--csv", type=Path, default=Path(__file__).with_name("quality.csv"))
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    rows = list(csv.DictReader(args.csv.open()))
    faults = []
    missing = {m["id"] for m in json.loads(run(args.btfc, "models", "--json"))} - {row["model"] for row in rows}
    if missing:
        faults.append(f"no row for {', '.join(sorted(missing))}")
    with tempfile.TemporaryDirectory() as folder:
        for row in rows:
            bits, psnr, distance = measure(args.btfc, Path(folder), row)
            print(f"{row['model']:6} {row['material']:6} {row['options']:60} {bits:>10} bits {psnr:>8} dB, distance {distance}")
            if args.write:
                row["payload_bits"], row["psnr_db"], row["autocorrelation"] = bits, psnr, distance
                continue
            if bits != int(row["payload_bits"]):
                faults.append(f"{row['model']} {row['options']}: {bits} bits, the table has {row['payload_bits']}")
            if psnr and float(psnr) < float(row["psnr_db"]) - LEAST_OF.get(row["model"], LEAST):
                faults.append(f"{row['model']} {row['options']}: {psnr} dB, the table has {row['psnr_db']}")
            if distance and float(distance) > float(row["autocorrelation"]) + MOST:
                faults.append(f"{row['model']} {row['options']}: {distance} away, the table has {row['autocorrelation']}")
    if args.write:
        with args.csv.open("w", newline="") as stream:
            writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
