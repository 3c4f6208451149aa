#!/usr/bin/env python3
"""SIGKILL at random times while the command encodes over files that exist.

kill_test.py --btfc PATH [--count 10] [--seed 1]

After every kill each output is the old file or the new one, whole: the .btfc, the report of --json and the image of
--synthesized. What may stay behind is the unfinished file, hidden beside its target under the target's name, a dot, six
characters and the target's extension. Half of the kills come at any time, half as soon as an unfinished file shows.
A fit of gm that is killed again and again and goes on from its --checkpoint ends with the chunks of one that was not.
"""

import argparse
import json
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# A file with one set of options is overwritten by the file with the other.
CASES = {
    "patch": ("tiles.png", ["--k", "6"], ["--k", "8", "--blend", "liang"], True),
    "ptm": ("knit", [], ["--precision", "u8"], False),
    "pca": ("knit", ["--rank", "2"], ["--rank", "4"], False),
    "lpca": ("knit", ["--clusters", "2", "--rank", "1"], ["--clusters", "3", "--rank", "2"], False),
    "car": ("tiles.png", ["--levels", "2"], ["--levels", "3"], False),
    "gm": ("knit", ["--components", "2", "--iterations", "20"], ["--components", "4", "--iterations", "30"], False),
}
OUTPUT, REPORT, SIDE = "out.btfc", "report.json", "side.png"
UNFINISHED = re.compile(r"\.(out\.btfc|report\.json|side\.png|em\.state|refined\.state)\.[A-Za-z0-9]{6}(\.[a-z]+)?")


def run(*arguments):
    done = subprocess.run(list(map(str, arguments)), capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr}")


def encode(btfc, folder, material, model, options, side):
    """The command line of an encode that writes its outputs into a folder."""
    line = [btfc, "encode", folder.parent / material, "-o", folder / OUTPUT, "--model", model, *options, "--threads", 1]
    line += ["--json", folder / REPORT] + (["--synthesized", folder / SIDE] if side else [])
    return list(map(str, line))


def chunks(file):
    """Type, key and hash of every chunk but META, which says how the file was made."""
    count = struct.unpack_from("<I", file, 24)[0]
    entries = [struct.unpack_from("<4sHHQQQQII", file, 64 + 48 * i) for i in range(count)]
    return [(e[0], e[7], e[8], e[5], e[6]) for e in entries if e[0] != b"META"]


def kill_at(line, delay, sign=None):
    """Starts a command and kills it after `delay` seconds, counted from when sign() is true where there is one. Returns
    whether it was still running."""
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while sign and process.poll() is None and not sign():
        time.sleep(0.0005)
    time.sleep(delay)
    running = process.poll() is None
    process.kill()
    process.wait()
    return running


class Overwrites:
    """Kills during encodes of one model over old outputs."""

    def __init__(self, btfc, base, model):
        material, old, new, side = CASES[model]
        self.folder = base / model
        self.folder.mkdir()
        self.model, self.side, self.counts = model, side, {"old": 0, "new": 0, "killed": 0, "left": 0}
        self.line = encode(btfc, self.folder, material, model, new, side)
        run(*encode(btfc, self.folder, material, model, old, side))
        self.old = self.outputs()
        start = time.monotonic()
        run(*self.line)
        self.seconds = time.monotonic() - start
        self.new = self.outputs()
        assert self.old[OUTPUT] != self.new[OUTPUT]

    def outputs(self):
        return {name: (self.folder / name).read_bytes() for name in (OUTPUT, REPORT, SIDE) if (self.folder / name).exists()}

    def kill(self, rng, number):
        for name, content in self.old.items():
            (self.folder / name).write_bytes(content)
        aimed = number % 2 == 1
        running = kill_at(self.line, rng.uniform(0, 0.03) if aimed else rng.uniform(0, 1.1 * self.seconds),
                          (lambda: any(self.folder.glob(".*"))) if aimed else None)
        self.counts["killed"] += running
        found = self.outputs()
        assert found.keys() == self.old.keys(), f"{self.model}: an output is gone"
        for name in found:
            # Reports hold the seconds that an encode took: whole, if not the same bytes.
            if name == REPORT and found[name] != self.old[name]:
                assert json.loads(found[name])["output"] == str(self.folder / OUTPUT)
            else:
                assert found[name] in (self.old[name], self.new[name]), f"{self.model}: {name} is neither old nor new"
        self.counts["new" if found[OUTPUT] == self.new[OUTPUT] else "old"] += 1
        for path in self.folder.glob(".*"):
            assert UNFINISHED.fullmatch(path.name), f"{path} was left"
            self.counts["left"] += 1
            path.unlink()


def resume(btfc, base, rng, kills):
    """gm with a checkpoint, killed again and again a moment after it has kept a state: the same chunks at the end."""
    folder = base / "resumed"
    folder.mkdir()
    said = []
    # refined keeps its state every 20 seconds, em after every iteration: the former where there is time.
    for fit, iterations in (("em", 400), ("refined", 60000))[:2 if kills >= 5 else 1]:
        options = ["--components", "4", "--fit", fit, "--iterations", iterations]
        line = encode(btfc, folder, "knit", "gm", options, False)
        run(*line)
        whole = (folder / OUTPUT).read_bytes()
        (folder / OUTPUT).unlink()
        state = folder / f"{fit}.state"
        line += ["--checkpoint", str(state)]
        killed = 0
        for _ in range(kills):
            before = state.stat().st_mtime_ns if state.exists() else None
            killed += kill_at(line, rng.uniform(0, 0.05), lambda: state.exists() and state.stat().st_mtime_ns != before)
        run(*line)
        same = chunks((folder / OUTPUT).read_bytes()) == chunks(whole)
        assert same, f"gm --fit {fit}: other chunks after {killed} kills"
        said.append(f"gm --fit {fit}: the same chunks after {killed} kills, each with a state kept")
    return said


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--btfc", required=True, type=Path)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    a = parser.parse_args()
    rng = random.Random(a.seed)
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        run(a.btfc, "synth", "tiles", "-o", base / "tiles.png", "--size", "64x64")
        run(a.btfc, "synth", "btf:knit", "-o", base / "knit", "--size", "8x8")
        # A few views are enough, and read in a moment.
        for view in sorted(path for path in (base / "knit").iterdir() if path.is_dir())[9:]:
            shutil.rmtree(view)
        overwrites = [Overwrites(a.btfc, base, model) for model in CASES]
        for number in range(a.count):
            overwrites[number // 2 % len(overwrites)].kill(rng, number)
        for o in overwrites:
            print(f"{o.model}: " + ", ".join(f"{n} {what}" for what, n in o.counts.items()))
        total = {what: sum(o.counts[what] for o in overwrites) for what in overwrites[0].counts}
        print(f"{a.count} SIGKILLs, {total['killed']} of them while the command ran: {total['old']} old files, {total['new']} "
              f"new ones, all whole; {total['left']} unfinished files left beside them")
        for line in resume(a.btfc, base, rng, max(2, a.count // 20)):
            print(line)


if __name__ == "__main__":
    main()
