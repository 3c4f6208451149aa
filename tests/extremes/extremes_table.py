#!/usr/bin/env python3
"""What every model does at the ends of what it may be given: makes spec/extremes.md, or holds the code to it.

extremes_table.py --btfc PATH --extremes PATH [--source DIR]          measures and writes the page; some minutes
extremes_table.py --btfc PATH --extremes PATH [--source DIR] --check  measures less, and compares with the page

Values are held against tests/reference, which decodes in doubles and shares no code with the library. --check ends with
status 1 where a row misbehaves, where the page has other rows, and where a message reads otherwise; figures may move
within the bound that stands in the row.
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
from collections import namedtuple
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/reference"), str(ROOT / "tests/extremes")]

import numpy as np

import btfc_reference as reference
import extreme_commands
import make_vectors as files

MODELS = ("patch", "gm", "car", "ptm", "plm", "pcarf", "pca", "lpca", "gmrf", "car3d")
NEAR = 1e-5  # of the largest value
LEAST_NORMAL = 2.0 ** -126
LOG, LAST_PLACE = 2, 2.0 ** -22  # gm keeps log(1 + value) where HEAD says so: below 1 that is to the last places of 1
QUERIES, QUERIES_CHECK = 12, 2  # of each kind, for each file
SAMPLES, SAMPLES_CHECK = 10 ** 9, 10 ** 7
FIELDS_CHECK = 30  # of so many files of random fields one
KINDS = {
    "grazing": "views at 84 to 90 degrees, lights at the horizon",
    "below": "lights below the horizon",
    "nothing": "directions of 0, not a number, infinite, 3e38, 1e-45",
    "far": "coordinates from -2^31 to 2^31 - 1",
}
BUILDS = "## Builds"  # from here on build_matrix.py writes the page

# measured is compared with the page where it is a message.
Row = namedtuple("Row", "model extreme required measured good message", defaults=(True, False))


def short(number):
    return f"{number:.2g}" if number else "0"


# ---- Files and their answers


class File:
    """One file of btfc_extremes in the reference reader's eyes."""

    def __init__(self, folder, case):
        self.case = case
        with open(folder / case["file"], "rb") as stream:
            self.item = reference.open_item(stream)
        self.size = max(case["largest"], LEAST_NORMAL)
        self.fitted = case["required"] != "made"

    def expected(self, query, view, light):
        head, model = self.item.head, self.item.model
        x, y = reference.place(head, query["x"], query["y"])
        if not model.VALUES:
            codes = np.array(reference.decode_texel(self.item, query["map"], int(x), int(y)))
            kind = head.maps[query["map"]].sample_type
            if kind == 2:
                return codes.astype("<u2").view("<f2").astype(float), 0.0
            return codes.astype(np.float32) / np.float32((255, 65535)[kind]), 0.0
        at = np.array([int(x)]), np.array([int(y)])
        values = model.values(query["map"], *at, view, light).reshape(-1)
        unsure = float(np.max(model.uncertainty(query["map"], *at, view, light)))
        return values, math.inf if math.isinf(unsure) else 0.0 if self.fitted else unsure

    def allowed(self):
        model = self.item.model
        logarithm = LAST_PLACE if self.item.head.transform == LOG else 0
        return NEAR * self.size + (model.error if model.VALUES else 0) + LEAST_NORMAL + logarithm

    def errors(self):
        """Kind of query -> worst error and whether all are within what is allowed; exactly equal where no value is made."""
        worst, seconds_each = {}, self.item.head.unbounded
        # Where the reference cannot bound what margins leave out, what the file states decides alone.
        if math.isinf(getattr(self.item.model, "margin_error", 0.0)):
            self.item.model.margin_error = 0.0
        for query in self.case["queries"]:
            if seconds_each and query["kind"] in worst:
                continue
            view, light = ([float(c) for c in query[key]] for key in ("view", "light"))
            if not all(math.isfinite(c) for c in view + light):
                continue  # that it is finite is known
            expected, unsure = self.expected(query, view, light)
            if math.isinf(unsure):
                continue  # either of two answers is right
            # Nine digits are a binary32 number.
            found = np.array([np.float32(v) for v in query["values"]]).astype(float)
            error = float(np.abs(found - expected).max())
            exact = not self.item.model.VALUES
            good = error == 0 if exact else error <= self.allowed() + unsure
            before = worst.get(query["kind"], (0.0, True))
            worst[query["kind"]] = max(before[0], error), before[1] and good
        return worst


def as_in_doubles(model):
    if model == "patch":
        return "every code as the reference has it"
    more = " and the file's error" if model in files.FIELDS else ", of logarithms 2^-22" if model == "gm" else ""
    return "as in doubles, within 1e-5" + more


def case_rows(folder, cases, every=1):
    """A row for each input, and what all files of a model have in common. Of random fields the reference takes a second a query: it is
    asked one of each kind, and with `every` of some files only; the others' values need but be finite."""
    rows, common, fields = [], {}, 0
    for case in cases:
        model, name, required = case["model"], case["name"], case["required"]
        if required == "equal":
            rows.append(Row(model, name, "the same raw bytes", "equal" if case["equal"] else "different", case["equal"], True))
            continue
        if "message" in case:
            good = required in ("refused", "made") and well_said(case["message"])
            rule = f" [{case['rule']}]" if case.get("rule") else ""
            rows.append(Row(model, name, "refused", case["message"] + rule, good, True))
            continue
        file = File(folder, case)
        fields += model in files.FIELDS
        errors = file.errors() if model not in files.FIELDS or fields % every == 0 else {}
        error, good = errors.pop("measured", (0.0, True))
        good = good and case["finite"] and required != "refused"
        wanted, measured = as_in_doubles(model), f"off by {short(error / file.size)}"
        if required == "comes back":
            what = "what was synthesised comes back" if model == "patch" else "the original comes back"
            wanted += f"; {what}" + (f" within {case['most']:g}" if case["most"] else "")
            measured += f"; back within {short(case['worst'])}"
            good = good and case["worst"] <= case["most"]
        if required == "mean":
            wanted += f"; the mean stays within {case['most']:g}"
            measured += f"; mean within {short(case['mean'])}"
            good = good and case["mean"] <= case["most"]
        rows.append(Row(model, name, wanted, measured, good))
        mine = common.setdefault(model, {"errors": {}, "flushed": (0.0, True), "threads": True, "finite": True, "files": 0})
        for kind, (e, fine) in errors.items():
            before = mine["errors"].get(kind, (0.0, True))
            mine["errors"][kind] = max(before[0], e / file.size), before[1] and fine
        flushed, fine = mine["flushed"]
        mine["flushed"] = max(flushed, max(0, case["flushed"] - LEAST_NORMAL) / file.size), fine and case["flushed"] <= file.allowed()
        mine["threads"] = mine["threads"] and case["threads_equal"]
        mine["finite"] = mine["finite"] and case["finite"]
        mine["files"] += 1
    for model, mine in common.items():
        for kind, name in KINDS.items():
            if model == "patch" and kind != "far":
                continue
            error, good = mine["errors"].get(kind, (0.0, True))
            rows.append(Row(model, name, "finite, and " + as_in_doubles(model), f"off by {short(error)} in {mine['files']} files",
                            good and mine["finite"]))
        error, good = mine["flushed"]
        rows.append(Row(model, "all files with denormals taken for 0", "what moves by more than 2^-126 moves by 1e-5 at most",
                        f"moves by {short(error)}", good and mine["finite"]))
        rows.append(Row(model, "all files by 1, 2 and 8 threads", "the same bits",
                        "equal" if mine["threads"] else "different", mine["threads"], True))
    return rows


def well_said(message):
    """A sentence, not a word: what, where, what was expected."""
    return len(message.split()) >= 5 and message[-1] != "\n" and "terminate" not in message


def instruction_rows(extremes, source):
    """Every vector's answers under each of the instruction sets that this processor has."""
    rows = []
    for model in MODELS:
        paths = sorted((source / "tests/vectors" / model).glob("*.btfc"))
        done = subprocess.run([extremes, "answers", *paths], capture_output=True, text=True, check=True)
        hashes = json.loads(done.stdout)
        good = all(h == list(hashes.values())[0] for h in hashes.values()) and len(hashes) > 1
        rows.append(Row(model, "all vectors under every instruction set of the processor", "the same bits",
                        "equal" if good else "different: " + ", ".join(hashes), good, True))
    return rows


def sum_rows(extremes, samples):
    done = subprocess.run([extremes, "sums", str(samples)], capture_output=True, text=True, check=True)
    return [Row(each["models"], f"very many samples: {each['name']}", f"within {each['bound']:.1g} {each['unit']}",
                f"off by {short(each['error'])} after {each['samples']:.2g}", each["error"] <= each["bound"]) for each in json.loads(done.stdout)]


# ---- The page


def plain(text):
    return re.sub(r"\s+", " ", text).strip().replace("|", "\\|")


def page(rows):
    order = {model: i for i, model in enumerate(MODELS)}
    rows = sorted(rows, key=lambda row: order.get(row.model, len(MODELS)))
    lines = ["| model | extreme | required | measured |", "|---|---|---|---|"]
    lines += [f"| {plain(r.model)} | {plain(r.extreme)} | {plain(r.required)} | {plain(r.measured)} |" for r in rows]
    return HEAD.format(count=len(rows)) + "\n".join(lines) + "\n\n" + SUITES + suites_table() + "\n"


def page_rows(text):
    """(model, extreme, required) -> measured"""
    body = text.split(BUILDS)[0]
    cells = [re.split(r"(?<!\\)\|", line)[1:-1] for line in body.splitlines() if line.startswith("| ")]
    return {tuple(c.strip() for c in row[:3]): row[3].strip() for row in cells if len(row) == 4 and row[0].strip() != "model"}


HEAD = """# Extremes

What every model does at the ends of what it may be given, {count} rows, made by

```
python3 tests/extremes/extremes_table.py --btfc build/release/btfc --extremes build/release/tests/btfc_extremes
```

A shorter run with `--check` is a test: it fails where a row misbehaves, where this page has other rows, and where a message
reads otherwise; figures may move below the bound beside them. "Off by" is the worst difference from the reference reader
(tests/reference, in doubles), as a share of the largest value of the file and of what was fitted; every file is asked under measured and other
directions, by queries and by whole maps, on 1, 2 and 8 threads, with and without denormals, and each value must be finite.
Random fields may differ by what the file states as its error too (models/car.md 1). Inputs are in
`tests/extremes/extreme_inputs.cpp`; where not said otherwise 9x8 texels, 3 channels of 8 bits, 7 views and 7 lights. Files "by hand" and those of
stored numbers were not fitted: of them a decoder in binary32 may be off by what rounding its inputs does.

"""

SUITES = """## Held by suites

What takes a device, much memory or a file of its own; the names are those of tests.

"""

HELD = (
    ("every truncation and every changed byte of a file", "Hostile.EveryTruncationIsRefused, Hostile.EveryByteOfASmallFile, Hostile.SomeValuesOfEveryByte"),
    ("every numbered rule broken, sizes and offsets that overflow, frames that lie", "Rules.EachIsNamedWhenItIsBroken"),
    ("10^8 random texels outside, in parts", "EveryModel.RandomTexelsOutside, EveryModel.RandomRectanglesOfThePlane"),
    ("gm: 10^6 queries against doubles, gates that tie, ends of all codes and of rule GM4", "GmExtremes.AMillionQueriesAgainstDoubles, GmExtremes.EveryNumberOfGatesWithTies, GmExtremes.EndsOfCodes, GmExtremes.EndsOfRuleGm4"),
    ("gm: 10^8 pairs of samples and components, footprints from 0 to infinity", "GmExtremes.EmPassOver100MillionPairsFarFromTheOrigin, GmExtremes.FootprintsFromNothingToInfinity"),
    ("car, car3d: estimates that are unstable, roots next to the unit circle, no noise at all", "FieldStability.UnstableEstimatesAreRepaired, FieldStability.NextToTheUnitCircle, FieldStability.NothingToModel"),
    ("car, gmrf, car3d: random windows against one, floats against doubles, by margin", "FieldCollapse.SeamsByMargin, FieldSynthesis.MarginsAgainstDoubles"),
    ("photometric stereo: identical, three, grazing lights, black texels", "PhotometricStereo.LightsThatDetermineNothing, PhotometricStereo.OddTexels"),
    ("lights on a line, on a ring, beyond the horizon; missing pairs; triangles that are none", "Ptm.LightsOnALineOrOnOneSide, Ptm.InverseIsThatOfLeastNorm, Triangulation.OfPointsOnALineAndOfOne, Corners.OfNonsenseAreTheNormals"),
    ("ptm: rows over three word slots, 364 MiB at 256x256 texels and 81 views", "Ptm.RowsOfAllSlotsAreFound, ShaderRunner.RowsOverSeveralSlots"),
    ("shaders: every vector in both stages, arguments of any bits, noise for data, empty images, lacking devices", "Shaders.EveryVectorInBothStages, Shaders.SamplesAreFiniteWhateverTheBits, Shaders.RobustModeTakesAnyData, ShaderRunner.ImagesOfOneTexelAndOfNone, VulkanNeeds.WhatADeviceLacksIsSaid"),
    ("readers: repeated pairs, spellings of one direction, UBO2014 files cut anywhere or with sizes that lie", "DatasetImages.RepeatedPairsAreRefusedWithBothFiles, DatasetImages.AllSpellingsOfADirectionAreOne, Ubo2014Test.EveryTruncationIsAnError, Ubo2014Test.FaultsAreNamed"),
    ("measures: images below the filters' sizes, equal, opposite, with a hot texel", "Ssim.NothingBelowItsWindow, Flip.ImagesSmallerThanTheFilters, Flip.BlackAgainstWhite, DatasetMetrics.OppositeSets, DatasetMetrics.AHotTexelCountsAsWhite"),
    ("65,536 x 65,536 texels decoded by region in little memory; writes to a full disk", "DecodeTest.test_largest_texture_by_regions, EncodeTest.test_failed_writes_leave_what_was"),
)


def suites_table():
    return "\n".join(["| extreme | tests |", "|---|---|", *(f"| {what} | {names} |" for what, names in HELD)]) + "\n"


def missing_suites(source):
    """Names in the list of suites that no test has."""
    text = "".join(p.read_text() for p in (source / "tests").rglob("*_test.*"))
    there = {f"{suite}.{name}" for suite, name in re.findall(r"TEST(?:_F|_P)?\((\w+), (\w+)\)", text)}
    for suite, body in re.findall(r"^class (\w+)\(.*?\):(.*?)(?=^class |\Z)", text, re.M | re.S):
        there |= {f"{suite}.{name}" for name in re.findall(r"def (test_\w+)", body)}
    return [name for _, names in HELD for name in names.split(", ") if name not in there]


def measure(args, folder):
    queries, samples = (QUERIES_CHECK, SAMPLES_CHECK) if args.check else (QUERIES, SAMPLES)
    subprocess.run([args.extremes, "files", folder, str(queries)], check=True)
    rows = case_rows(folder, json.loads((folder / "cases.json").read_text()), FIELDS_CHECK if args.check else 1)
    rows += instruction_rows(args.extremes, args.source)
    rows += [Row(*row) for row in extreme_commands.rows(args.btfc, args.source, folder)]
    return rows + sum_rows(args.extremes, samples)


def compare(rows, text):
    """What page and measurement say differently, one line each."""
    there, found = page_rows(text), {(plain(r.model), plain(r.extreme), plain(r.required)): r for r in rows}
    said = [f"the page lacks {key}" for key in found if key not in there]
    said += [f"only the page has {key}" for key in there if key not in found]
    said += [f"{key}: the page says '{there[key]}', found '{plain(r.measured)}'" for key, r in found.items()
             if r.message and key in there and there[key] != plain(r.measured)]
    return said


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--btfc", required=True, type=Path)
    parser.add_argument("--extremes", required=True, type=Path)
    parser.add_argument("--source", type=Path, default=ROOT)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    args.btfc, args.extremes = args.btfc.resolve(), args.extremes.resolve()
    target = args.source / "spec/extremes.md"
    text = target.read_text() if target.exists() else ""
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(args, Path(folder))
    wrong = [f"{r.model}, {r.extreme}: required: {r.required}; found: {r.measured}" for r in rows if not r.good]
    wrong += [f"no test is named {name}" for name in missing_suites(args.source)]
    if len({(r.model, r.extreme, r.required) for r in rows}) < len(rows):
        wrong.append("two rows have one name")
    if args.check:
        wrong += compare(rows, text)
    else:
        builds = text[text.index(BUILDS):] if BUILDS in text else ""
        target.write_text(page(rows) + (f"\n{builds}" if builds else ""))
    print("\n".join(wrong + [f"{len(rows)} rows, {len(wrong)} wrong"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
