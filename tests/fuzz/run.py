#!/usr/bin/env python3
"""Runs fuzz targets for so many minutes of CPU time each, from seeds and the kept corpus.

run.py --build build/fuzz --work DIR [--minutes 30] [--jobs 2] [TARGET...]

Inputs lie in DIR/<target>, findings (crash-, timeout-, oom-) beside them, what libFuzzer says in DIR/<target>.log. A target
that finds something stops; started again it goes on from its inputs, for the time that is left of --minutes (kept in
DIR/<target>.seconds). --minimise instead writes the fewest inputs that reach as much to corpus/<target>.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
MINUTES = {"open": 30, "params": 30, "decode": 30, "api": 30, "chunk": 10, "differential": 10, "round_trip": 10}
TICKS = os.sysconf("SC_CLK_TCK")


def cpu_seconds(pid):
    """User and system time of a process and the children it has waited for or still has."""
    total, pids = 0, [pid]
    for task in pids:
        try:
            text = Path(f"/proc/{task}/stat").read_text()
            pids += map(int, Path(f"/proc/{task}/task/{task}/children").read_text().split())
        except OSError:
            continue
        total += sum(map(int, text.rpartition(")")[2].split()[11:15]))
    return total / TICKS


class Run:
    def __init__(self, target, a):
        self.target, self.folder = target, a.work / target
        self.folder.mkdir(parents=True, exist_ok=True)
        self.kept = a.work / f"{target}.seconds"
        self.before = float(self.kept.read_text()) if self.kept.exists() else 0.0
        self.left = 60 * (a.minutes or MINUTES[target]) - self.before
        self.process = None

    def start(self, a):
        line = [a.build / "tests/fuzz" / f"fuzz_{self.target}", self.folder, a.work / "seeds" / self.target,
                HERE / "corpus" / self.target, f"-artifact_prefix={self.folder}/../{self.target}-", "-max_len=16384",
                "-timeout=60", "-rss_limit_mb=2048", "-print_final_stats=1", "-use_value_profile=1", "-reload=0"]
        log = open(a.work / f"{self.target}.log", "a")
        line = [str(part) for part in line if not isinstance(part, Path) or part.exists()]
        self.process = subprocess.Popen(line, stdout=log, stderr=log)
        self.used = 0.0

    def running(self):
        if self.process.poll() is None:
            self.used = cpu_seconds(self.process.pid) or self.used
            self.kept.write_text(f"{self.before + self.used:.1f}")
            if self.used < self.left:
                return True
            self.process.send_signal(signal.SIGINT)
            self.process.wait()
        return False


def say(a, targets):
    for target in targets:
        log, kept = a.work / f"{target}.log", a.work / f"{target}.seconds"
        if not log.exists() or not kept.exists():
            continue
        text = log.read_text(errors="replace")
        executed = sum(map(int, re.findall(r"stat::number_of_executed_units: (\d+)", text)))
        inputs = len(list((a.work / target).iterdir()))
        found = [path.name for path in a.work.glob(f"{target}-*")]
        print(f"{target}: {float(kept.read_text()) / 60:.1f} CPU minutes, {executed} executions, {inputs} inputs, "
              f"findings: {', '.join(found) or 'none'}", flush=True)


def minimise(a, targets):
    for target in targets:
        out, old = HERE / "corpus" / target, a.work / f"{target}.old"
        shutil.rmtree(old, ignore_errors=True)
        if out.exists():
            shutil.move(out, old)
        out.mkdir(parents=True)
        sources = [f for f in (old, a.work / target, a.work / "seeds" / target) if f.exists()]
        subprocess.run([str(a.build / "tests/fuzz" / f"fuzz_{target}"), "-set_cover_merge=1", "-max_len=16384", str(out), *map(str, sources)],
                       check=True, stderr=subprocess.DEVNULL)
        # File names are unique across the tree.
        files = [f.rename(out / f"{target}.{f.name[:12]}") for f in out.iterdir()]
        print(f"{target}: {len(files)} inputs, {sum(f.stat().st_size for f in files)} bytes", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("targets", nargs="*", default=list(MINUTES))
    parser.add_argument("--build", type=Path, default=HERE.parents[1] / "build/fuzz")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--minimise", action="store_true")
    parser.add_argument("--say", action="store_true")
    a = parser.parse_args()
    if a.minimise:
        return minimise(a, a.targets)
    if not a.say:
        seeds = a.work / "seeds"
        if not seeds.exists():
            subprocess.run([a.build / "tests/fuzz/btfc_fuzz_seeds", HERE.parent / "vectors", seeds], check=True)
        waiting, active = [Run(target, a) for target in a.targets], []
        waiting = [run for run in waiting if run.left > 0]
        while waiting or active:
            while waiting and len(active) < a.jobs:
                active.append(waiting.pop(0))
                active[-1].start(a)
            time.sleep(1)
            active = [run for run in active if run.running()]
    say(a, a.targets)


sys.exit(main())
