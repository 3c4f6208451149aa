#!/usr/bin/env python3
"""Seconds, anonymous memory and scratch space of reading and comparing data sets; run by hand.

dataset_table.py --btfc PATH [--make FOLDER [--side N]] [--measures LIST] SET…

Each SET is read by `btfc convert` and held against itself by `btfc compare --measures LIST` (default psnr). Peak RssAnon
is that of /proc/PID/status, looked at every 10 ms. "plain" is reading the same files without decoding them, after they
were read once: the page cache's speed where they fit. --make first writes a directory of 81 x 81 PNG files of N x N
texels (default 560: 6.17 GB) whose deflate blocks are stored, with names of UBO2003, and adds it to the sets.
Nothing is judged. Debian packages: python3-numpy for --make.
"""

import argparse
import json
import re
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def make(folder, side):
    import numpy
    rings = ((0, 1), (15, 6), (30, 12), (45, 18), (60, 20), (75, 24))
    directions = [(theta, 360 * i // n) for theta, n in rings for i in range(n)]
    base = numpy.random.default_rng(1).integers(0, 200, (side, side, 3), dtype=numpy.uint8)
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
    number = 0
    for tv, pv in directions:
        (folder / f"tv{tv:03}_pv{pv:03}").mkdir(parents=True, exist_ok=True)
        for tl, pl in directions:
            rows = numpy.zeros((side, 3 * side + 1), numpy.uint8)  # filter 0 before each row
            rows[:, 1:] = (base + numpy.uint8(number * 37 % 55)).reshape(side, -1)
            name = f"{number:05} tl{tl:03} pl{pl:03} tv{tv:03} pv{pv:03}.png"
            (folder / f"tv{tv:03}_pv{pv:03}" / name).write_bytes(
                b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows.tobytes(), 0)) + chunk(b"IEND", b""))
            number += 1


def measured(*command, allowed=(0,)):
    """(output, seconds, peak RssAnon in MiB)"""
    begin, peak = time.monotonic(), 0
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    while process.poll() is None:
        try:
            found = re.search(r"RssAnon:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text())
            peak = max(peak, int(found[1]) if found else 0)
        except OSError:
            pass
        time.sleep(0.01)
    seconds = time.monotonic() - begin
    if process.returncode not in allowed:
        sys.exit(f"{' '.join(map(str, command))}: exit code {process.returncode}")
    return process.stdout.read(), seconds, peak / 1024


def plain_read(path):
    files = [p for p in sorted(path.rglob("*")) if p.is_file()] if path.is_dir() else [path]
    for last in (False, True):  # the second time from the page cache
        begin, size = time.monotonic(), 0
        for file in files:
            with open(file, "rb", buffering=0) as opened:
                while data := opened.read(1 << 20):
                    size += len(data)
        if last:
            return size, time.monotonic() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--btfc", required=True)
    parser.add_argument("--make", type=Path)
    parser.add_argument("--side", type=int, default=560)
    parser.add_argument("--measures", default="psnr")
    parser.add_argument("sets", nargs="*", type=Path, metavar="SET")
    options = parser.parse_args()
    if options.make:
        make(options.make, options.side)
        options.sets.append(options.make)
    print("| set | kind | texels | pairs | raw GB | scratch GB | read s | RssAnon MiB | plain s | compare s | RssAnon MiB |")
    print("|" + "---|" * 11)
    for path in options.sets:
        text, read_seconds, read_memory = measured(options.btfc, "convert", path, "--json")
        told = json.loads(text)
        _, compare_seconds, compare_memory = measured(options.btfc, "compare", path, path, "--measures",
                                                      options.measures)
        _, plain_seconds = plain_read(path)
        print(f"| {path.name} | {told['kind']} | {told['width']}x{told['height']} | {told['pairs']} "
              f"| {told['raw_bytes'] / 1e9:.2f} | {told['scratch_bytes'] / 1e9:.2f} | {read_seconds:.1f} "
              f"| {read_memory:.0f} | {plain_seconds:.1f} | {compare_seconds:.1f} | {compare_memory:.0f} |", flush=True)


if __name__ == "__main__":
    main()
