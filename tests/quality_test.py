#!/usr/bin/env python3
"""Size and quality of every model on generated material, held against tests/quality.csv.

quality_test.py --btfc PATH [--csv FILE] [--write]

A payload may not change and a PSNR not fall by more than 0.02 dB (of gm 0.2) without a change of the table; --write makes it anew.
The models of random fields synthesise texels of their own, which a PSNR says nothing about: of an image made of them the distance
of the autocorrelation (`compare --statistics`) may not grow by more than 0.02, and of a BTF the error of the mean BRDF, which
depends on its subspaces, by more than 0.3 of 255.
Every model of `btfc models` must have a row.
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

COLUMNS = ("model", "material", "options", "payload_bits", "psnr_db", "autocorrelation", "brdf_rmse_8bit")
LEAST = 0.02  # dB
MOST = {"autocorrelation": 0.02, "brdf_rmse_8bit": 0.3}  # that a distance may grow
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
    """What the row's file is like, by column, as text."""
    source, out = material(btfc, folder, row["material"]), folder / "out.btfc"
    said = json.loads(run(btfc, "encode", source, "-o", out, "--model", row["model"], *row["options"].split(), "--json"))
    found = {"payload_bits": str(said["payload_bits"])}
    field = row["model"] in FIELDS
    how = ["--statistics"] if field and not source.is_dir() else ["--measures", "psnr"]
    compared = json.loads(run(btfc, "compare", source, out, *how, "--json"))
    if not field:
        found["psnr_db"] = f"{compared['psnr_db']:.3f}"
    elif source.is_dir():
        found["brdf_rmse_8bit"] = f"{compared['brdf_rmse_8bit']:.2f}"
    else:
        found["autocorrelation"] = f"{compared['distances']['autocorrelation_distance']['value']:.3f}"
    return found


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
            found = measure(args.btfc, Path(folder), row)
            print(f"{row['model']:6} {row['material']:6} {row['options']:60} " + "  ".join(f"{k} {v}" for k, v in found.items()))
            if args.write:
                row.update(found)
                continue
            name = f"{row['model']} {row['options']}"
            if found["payload_bits"] != row["payload_bits"]:
                faults.append(f"{name}: {found['payload_bits']} bits, the table has {row['payload_bits']}")
            if "psnr_db" in found and float(found["psnr_db"]) < float(row["psnr_db"]) - LEAST_OF.get(row["model"], LEAST):
                faults.append(f"{name}: {found['psnr_db']} dB, the table has {row['psnr_db']}")
            for column, most in MOST.items():
                if column in found and float(found[column]) > float(row[column]) + most:
                    faults.append(f"{name}: {column} {found[column]}, the table has {row[column]}")
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
