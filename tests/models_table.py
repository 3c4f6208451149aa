#!/usr/bin/env python3
"""Models against a BTF: sizes, errors, fit seconds, decode rates and cost a texel, as a Markdown table; run by hand.

models_table.py --btfc PATH [--only TEXT] SET…      SET: whatever `btfc encode` takes as a data set
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

SETTINGS = [
    ("gm", "--bytes 24576"), ("gm", "--bytes 62883"),
    ("car", ""), ("car", "--clusters 4"), ("gmrf", ""), ("car3d", ""),  # synthesised: their errors say little
    ("ptm", "--precision f32"), ("ptm", "--precision u8"),
    ("plm", "--precision f32"), ("plm", "--precision u8"), ("plm", "--precision u8 --clusters 256"),
    ("pcarf", "--rank 8 --precision f32"), ("pcarf", "--rank 8 --precision u8"),
    ("pca", "--rank 8 --precision f32"), ("pca", "--rank 8 --precision u8"),
    ("pca", "--rank 41 --precision f32"), ("pca", "--rank 41 --precision u8"),
    ("lpca", "--clusters 8 --rank 8 --precision f32"), ("lpca", "--clusters 8 --rank 8 --precision u8"),
    ("lpca", "--clusters 32 --rank 19 --precision f32"), ("lpca", "--clusters 32 --rank 19 --precision u8"),
]


def said(btfc, *arguments):
    done = subprocess.run([btfc, *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 7):
        sys.exit(f"btfc {' '.join(map(str, arguments))}: {done.stderr}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--only", default="", help="settings that hold this text")
    parser.add_argument("sets", nargs="+")
    args = parser.parse_args()
    print("| set | model | payload bytes | file bytes | ratio at 8 bit | PSNR | SSIM | MAE Lab | FLIP | fit s | "
          "Mtexel/s | random | operations | reads |\n|" + "---|" * 14)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.btfc"
        for name in args.sets:
            for model, options in SETTINGS:
                if args.only not in f"{model} {options}":
                    continue
                made = said(args.btfc, "encode", name, "-o", out, "--model", model, *options.split())
                info, rates = said(args.btfc, "info", out), said(args.btfc, "bench", out, "--seconds", "0.2")
                error = said(args.btfc, "compare", name, out)
                print(f"| {Path(name).name} | {model} {options.replace('--', '')} | {made['payload_bits'] // 8} | "
                      f"{made['file_bytes']} | {made['ratio_u8']:.1f} | {error['psnr_db']:.2f} | {error['ssim']:.3f} | "
                      f"{error['mae_lab']:.2f} | {error['flip']:.3f} | {made['seconds'] - made['read_seconds']:.1f} | "
                      f"{rates['cpu_full_mtexel_s']:.1f} | {rates['cpu_batch_mtexel_s']:.2f} | "
                      f"{info['cost']['operations']} | {info['cost']['reads']} |", flush=True)


if __name__ == "__main__":
    main()
