#!/usr/bin/env python3
"""Builds the libraries with other optimisation and for other processors, and compares what they decode and fit.

build_matrix.py [--source DIR] [--builds DIR] [--jobs N] [--only NAME,…]     by hand; writes the last section of spec/extremes.md

Answers of every vector, under every instruction set that a build can choose at run time, and the payload of `patch` must be
equal in all builds; fits in floats within 0.01 dB, with equal hashes over thread counts.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
HEADING = "## Builds"
# Name -> the compiler's flags, and what the processor must have. Contraction is off by the project's own flag in all.
BUILDS = {
    "-O3": ("-O3", ()),
    "-O0": ("-O0", ()),
    "-O3 -march=x86-64-v2": ("-O3 -march=x86-64-v2", ("sse4_2",)),
    "-O3 -march=x86-64-v3 -mfma": ("-O3 -march=x86-64-v3 -mfma", ("avx2", "fma")),
    "-O3 -march=x86-64-v4 -mfma": ("-O3 -march=x86-64-v4 -mfma", ("avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512cd")),
}
MOST_DB = 0.01


def processor():
    text = Path("/proc/cpuinfo").read_text()
    return set(next(line for line in text.splitlines() if line.startswith("flags")).split(":")[1].split())


def build(name, flags, args):
    folder = args.builds / name.replace(" ", "")
    options = ["-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_FLAGS={flags} -DNDEBUG", "-DBTFC_TESTS=ON", "-DBTFC_TOOLS=ON"]
    subprocess.run(["cmake", "-S", args.source, "-B", folder, "-G", "Ninja", *options], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--target", "btfc_extremes", "-j", str(args.jobs)], check=True)
    return folder / "tests/btfc_extremes"


def ask(program, *args):
    return json.loads(subprocess.run([program, *args], capture_output=True, text=True, check=True).stdout)


def section(found, lacking, wrong):
    sets = {name: ", ".join(answers) for name, (answers, _) in found.items()}
    lines = [HEADING, "", "By `python3 tests/extremes/build_matrix.py`, by hand: the libraries built with these flags, contraction off in all by the",
             "project's own flag. Each decodes all vectors under every instruction set that it can choose at run time.", "",
             "| build | decoded under | answers of all vectors | payload of `patch` | fits, most that PSNR moves | 1, 2 and 8 threads |",
             "|---|---|---|---|---|---|"]
    first = next(iter(found.values()), None)
    for name, (answers, fits) in found.items():
        same = all(a == first[0][next(iter(first[0]))] for a in answers.values())
        patch = [f["hashes"][0] for f in fits if f["model"] == "patch"] == [f["hashes"][0] for f in first[1] if f["model"] == "patch"]
        moves = max(abs(a["psnr_db"] - b["psnr_db"]) for a, b in zip(fits, first[1]))
        threads = all(len(set(f["hashes"])) == 1 for f in fits)
        if not (same and patch and moves <= MOST_DB and threads):
            wrong.append(name)
        lines.append(f"| `{name}` | {sets[name]} | {'equal' if same else 'different'} | {'equal' if patch else 'different'} | "
                     f"{moves:.2g} dB | {'equal' if threads else 'different'} |")
    lines += [f"| `{name}` | not run: the processor lacks {what} | | | | |" for name, what in lacking.items()]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--source", type=Path, default=ROOT)
    parser.add_argument("--builds", type=Path, default=ROOT / "build/matrix")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", type=lambda text: text.split(","), help="names of builds; the page is not written then")
    args = parser.parse_args()
    vectors = sorted(map(str, (args.source / "tests/vectors").glob("*/*.btfc")))
    has, found, lacking, wrong = processor(), {}, {}, []
    for name, (flags, needs) in BUILDS.items():
        if args.only and name not in args.only:
            continue
        missing = [need for need in needs if need not in has]
        if missing:
            lacking[name] = ", ".join(missing)
            print(f"{name}: not run, the processor lacks {lacking[name]}")
            continue
        program = build(name, flags, args)
        found[name] = ask(program, "answers", *vectors), ask(program, "fits")
    text = section(found, lacking, wrong)
    print(text)
    page = args.source / "spec/extremes.md"
    if not args.only:
        body = page.read_text() if page.exists() else ""
        page.write_text(body.split(HEADING)[0].rstrip("\n") + "\n\n" + text)
    print(f"{len(found)} builds, {len(wrong)} differ" + "".join(f"\n{name} differs" for name in wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
