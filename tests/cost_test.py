#!/usr/bin/env python3
"""The cost of a texel that `btfc info` gives, against what the shaders execute (spec/tables.md section 6).

cost_test.py --btfc PATH --dump PATH --words PATH --glslang PATH [--spirv FOLDER] [--source DIR] [--only MODEL]

The decoding shader of each model, compiled here with the names of its functions, is interpreted (spirv_cost.py) for texels
of the committed vectors and of files encoded here, so that every parameter of every formula varies. Its values must be the decoder's, which shows that the interpreter is right, and its
counts of floating-point operations and of words read those of the formula: exactly, where all corners have a weight, once
the branches that data decide are put at what the formula takes them for. Those branches, and nothing else, are corrected
for, by counting them:

  logarithm   26 operations or 27; the formula has 27
  angles      gm's directions, 102 to 126, with printed angles 128; the formula has the most
  maxima      gm adds 21 each time a gate exceeds all before it; the formula has bit_width(M) times, with gates K once
  lobes       plm skips 44 operations of a lobe that is turned away; the formula has none
  halves      a zero or subnormal half takes a product; the formula has none
  straddling  an entry of packed bits may lie in two words; the formula has two where that can be
  subspaces   a field's texel is under one to four; the formula has the most
and texels are chosen, of fields those that take part in the most texels of coarser levels (up to 9, 16, 16 …), of patch
those where the most patches meet. Others, and those where fewer corners have a weight, must not be above the formula.
"none" under exact texels: the file's directions have no triangles.

Random fields are counted twice, as they are and with a prepared atlas (car.md 7); there every texel of the window takes
part, and one outside of it must take what it takes without. The SPIR-V that the build ships, without names and pruned, must
execute as many operations and reads, with the same value, as what is counted here: a texel of each file, but of those
that take long.
"""

import argparse
import json
import random
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
import btf_sets as sets
import make_vectors as files
import spirv_cost

CORNERS, HALF, NOISE, LOG, ANGLES = "btfc_corners", "btfc_half_to_float", "field_noise_integer", "btfc_log2", "gm_directions"
APART = (CORNERS, HALF, NOISE, LOG, ANGLES)
TOLERANCE = 1e-5  # of the file's largest value
NOISE_INTEGERS = 45  # of one noise
LOBE_SKIPPED, MAXIMUM, LOG_PRICE, ANGLES_PRICE = 44, 21, 27, 126
GM_TRANSFORM = 17  # word of GmParams
RESPONSES, ATLAS = 1, 2  # slots
QUICK, MOST_OPERATIONS = 20000, 1200000  # texels that many are interpreted of, or one; beyond, none
PARAMS, QUERIES, VALUES = 4, 5, 6  # bindings beyond the slots'


def run(*args):
    done = subprocess.run([str(a) for a in args], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, args))}: {done.stderr or done.stdout}")
    return done.stdout


class File:
    """A file, what `info` and `size` say of it, and what a shader is given. window: (x, y, width, height) that are prepared."""

    def __init__(self, tools, folder, path, window=None):
        self.path, self.tools, self.folder, self.window = path, tools, folder, window
        wanted = ("--window", ",".join(map(str, window))) if window else ()
        self.said = json.loads(run(tools.words, path, folder / "words.u32", *wanted))
        self.cost = self.said["cost_prepared" if window else "cost"]
        data = (folder / "words.u32").read_bytes()
        words, parts, at = struct.unpack(f"={len(data) // 4}I", data), [], 1
        for _ in range(words[0] + 4):
            parts.append(list(words[at + 1:at + 1 + words[at]]))
            at += 1 + words[at]
        self.params, self.slots = parts[:words[0]], parts[words[0]:]

    def values(self, queries):
        """As the decoder has them, of the first map."""
        (self.folder / "queries.txt").write_text(sets.query_lines(queries))
        run(self.tools.dump, self.path, "--queries", self.folder / "queries.txt", self.folder / "values.f32")
        data, channels = (self.folder / "values.f32").read_bytes(), self.said["maps"][0]["channels"]
        return list(struct.iter_unpack(f"={channels}f", data))


class Shader:
    """The decoding shader of a model. Only this class knows how its inputs are bound."""

    def __init__(self, spirv, apart=APART):
        self.program = spirv_cost.load(spirv).build((), apart)

    @classmethod
    def compiled(cls, glslang, source, folder, model):
        """As shaders/CMakeLists.txt does, but with names."""
        spirv = folder / f"{model}.spv"
        run(glslang, "--quiet", "-V", "--target-env", "vulkan1.1", f"-DBTFC_MODEL=BTFC_MODEL_{model.upper()}",
            source / "shaders/btfc_decode.comp", "-o", spirv)
        return cls(spirv)

    @classmethod
    def shipped(cls, folder, model):
        """Without names nothing can be counted apart."""
        path = folder / f"btfc_decode.{model}.comp.spv"
        if not path.is_file():
            sys.exit(f"SPIR-V of {model} is missing in {folder}")
        return cls(path, ())

    def run(self, file, query):
        """The four numbers of a texel of the first map, and the counts."""
        params, values = file.params[0] + [0] * (32 - len(file.params[0])), {}
        footprint, level, source = 1.0, 0, 0
        push = [spirv_cost.word_of(v) for v in (*query["view"], footprint, *query["light"], 0.0)]
        push += [query["x"] & 0xFFFFFFFF, query["y"] & 0xFFFFFFFF, 1, 1, level, source]
        counts = self.program.run((0, 0), {**dict(enumerate(file.slots)), PARAMS: params, QUERIES: {}, VALUES: values}, push)
        return values[0, 0], counts

    @staticmethod
    def totals(counts):
        """Operations and reads of all accounts."""
        reads = sum(n for account in counts.values() for key, n in account.items() if key[0] == "read")
        return sum(account["float"] for account in counts.values()), reads


def closest_pairs(said):
    return min(4, min(3, said["views"]) * min(3, said["lights"]))


def entry_words(parameters):
    """Words that an entry of the subspace index may take."""
    bits = (parameters["clusters"] - 1).bit_length()
    return 0 if bits == 0 else 1 if 32 % bits == 0 else 2


def most_places(said):
    """(step, remainder) of coordinates of the texels that take part in the most texels of coarser levels."""
    return {1: (1, 0), 2: (2, 0)}.get(said["parameters"]["levels"], (4, 2))


class Texel:
    """What one texel took, with what the docstring above corrects for."""

    def __init__(self, file, shader, query):
        self.query, self.cost, self.prepared = query, file.cost, file.window is not None
        self.value, counts = shader.run(file, query)
        self.totals = Shader.totals(counts)
        self.said = said = file.said
        p = said["parameters"]
        main, self.calls = counts[""], lambda name: counts[""]["call", name]
        self.counted = sum(counts[n]["float"] for n in ("", HALF, LOG, ANGLES))
        self.words = self.reads = sum(n for name, c in counts.items() if name != CORNERS
                                      for key, n in c.items() if key[0] == "read")
        self.faults = []
        self.priced(counts, LOG, LOG_PRICE - 1, LOG_PRICE)
        printed = 2 if p.get("onion") == "printed" else 0
        self.priced(counts, ANGLES, 100, ANGLES_PRICE + printed)
        if self.prepared and (self.calls(NOISE) or main["read", RESPONSES] or not main["read", ATLAS]):
            self.faults.append("not read from the atlas alone")
        if counts[NOISE]["integer"] != NOISE_INTEGERS * self.calls(NOISE):
            self.faults.append(f"{counts[NOISE]['integer'] / self.calls(NOISE)} integer operations a noise")
        self.operations = (main["float"] + LOG_PRICE * self.calls(LOG) + (ANGLES_PRICE + printed) * self.calls(ANGLES))
        if said["model"] == "gm":
            most = p["gates"] and min(p["gates"], p["components"])
            added = most or p["components"]
            raised = self.calls("btfc_exp2") - added - (4 if file.params[0][GM_TRANSFORM] == 2 else 0)
            self.operations += MAXIMUM * ((1 if most else p["components"].bit_length()) - raised)
        if said["unbounded"]:
            self.as_of_most_subspaces()
        self.corners = [sum(w > 0 for w in found[3:]) for found in shader.program.returned[CORNERS]]
        # Of directions inside triangles: 21 (s + 1) operations and 10 s + 2 reads, s triangles looked at.
        found = counts[CORNERS]
        steps, rest = divmod(found["float"] - 21 * len(self.corners), 21)
        if all(n == 3 for n in self.corners) and (rest or found["read", 0] != 10 * steps + 2 * len(self.corners)):
            self.faults.append(f"a search for corners: {found['float']} operations, {found['read', 0]} reads")
        if said["model"] == "plm":
            channels = said["maps"][0]["channels"]
            self.operations += LOBE_SKIPPED * (self.corners[0] * channels - self.calls(LOG))

    def as_of_most_subspaces(self):
        """The formula is a sum over subspaces and of what they share, which is known."""
        p, cost = self.said["parameters"], self.cost
        products, relief = closest_pairs(self.said), p["range"] != "0x0"
        most = min(products, p["clusters"])
        fewer = most - self.calls("field_deviation")
        pair = self.said["pairs"] < self.said["views"] * self.said["lights"]
        shared = 45 + products + 117 * relief, products * (pair + entry_words(p)) + 17 * relief
        each = [divmod(cost[key] - part, most) for key, part in zip(("operations", "reads"), shared)]
        if any(rest for _, rest in each):
            self.faults.append(f"the formula less what {most} subspaces share is no multiple of them")
        self.operations += fewer * each[0][0]
        self.reads += fewer * each[1][0]

    def priced(self, counts, name, least, most):
        n, calls = counts[name]["float"], self.calls(name)
        if not least * calls <= n <= most * calls:
            self.faults.append(f"{name}: {n} operations in {calls} calls, expected {least} to {most} a call")

    def full(self):
        """Whether the texel is one that the formula is about."""
        said = self.said
        if any(n != min(3, of) for n, of in zip(self.corners, (said["views"], said["lights"]))):
            return False
        if said["unbounded"] and not self.prepared:
            step, rest = most_places(said)
            return all(c % step == rest for c in (self.query["x"], self.query["y"]))
        return True

    def slack(self):
        """Words by which packed entries may be fewer."""
        p = self.said["parameters"]
        if self.said["unbounded"]:
            return closest_pairs(self.said) * max(0, entry_words(p) - 1)
        if self.said["model"] == "patch" and p["pack"] == "packed" and p["w_e"] > 1:
            return 0 if 32 % (p["w_e"] - 1).bit_length() == 0 else 3
        return 0


def queries_of(said, count, rng):
    """Texels, of fields mostly those with most places; directions where most sets have triangles."""
    def direction(near):
        theta, phi = (rng.uniform(8, 18), rng.uniform(20, 70)) if near else (rng.uniform(38, 50), rng.uniform(35, 55))
        return sets.short(sets.vector_of((theta, phi)))

    out = []
    for i in range(count):
        x, y = rng.randrange(said["width"]), rng.randrange(said["height"])
        if said["unbounded"] and i % 5 != 4:
            step, rest = most_places(said)
            x, y = (step * rng.randrange(of // step) + rest for of in (said["width"], said["height"]))
        out.append({"map": 0, "x": x, "y": y, "view": direction(i & 1), "light": direction(i & 2)})
    return out


def allowed(file):
    """How far a texel may be from the decoder's, of values up to 1. Decoders may begin a recursion anywhere where the file's
    error allows it, and an atlas does; gain and relief at most double that."""
    return TOLERANCE if not file.window else max(TOLERANCE, 4 * file.said["parameters"]["error"])


def window_of(said):
    """Of an odd origin, and with all texels that are asked for inside."""
    return -3, -5, said["width"] + 10, said["height"] + 7


def outside(file, direct, shader):
    """Faults of a texel that the atlas does not reach: it is the direct form's."""
    x, y, width, _ = file.window
    query = {"map": 0, "x": x + width + 9, "y": y, "view": (0.3, 0.2, 0.9), "light": (0.2, -0.4, 0.8)}
    (value, counts), (expected, plain) = shader.run(file, query), shader.run(direct, query)
    return [] if value == expected and Shader.totals(counts) == Shader.totals(plain) else ["outside its window differs"]


def check(file, shader, shipped, rng):
    """Faults, and a row of the table."""
    said, name, faults = file.said, file.path.stem + (" prepared" if file.window else ""), []
    model, cost = said["model"], file.cost
    count = 200 if model == "patch" else 24 if not said["unbounded"] else 8 if cost["operations"] < QUICK else 1
    queries = queries_of(said, count, rng)
    texels, values = [Texel(file, shader, q) for q in queries], file.values(queries)
    largest = max([1.0, *(abs(v) for row in values for v in row)])
    worst = 0.0
    for texel, value in zip(texels, values):
        faults += [f"{model} {name}: {f}" for f in texel.faults]
        worst = max([worst, *(abs(a - b) for a, b in zip(texel.value, value))])
        if texel.operations > cost["operations"] or texel.reads > cost["reads"]:
            faults.append(f"{model} {name} {texel.query}: {texel.operations} operations and {texel.reads} reads, the formula "
                          f"has {cost['operations']} and {cost['reads']} at most")
    if worst > allowed(file) * largest:
        faults.append(f"{model} {name}: values differ by {worst} from the decoder's")
    if shipped and count > 1:
        value, counts = shipped.run(file, queries[0])
        if value != texels[0].value or Shader.totals(counts) != texels[0].totals:
            faults.append(f"{model} {name}: {value} after {Shader.totals(counts)} operations and reads by the shipped shader, "
                          f"{texels[0].value} after {texels[0].totals} by its source")
    if cost["bytes"] != 4 * cost["reads"]:
        faults.append(f"{model} {name}: {cost['bytes']} bytes for {cost['reads']} words")
    full = [t for t in texels if t.full()]
    if model == "patch":  # the formula is that of the dearest texel
        most = max(t.reads for t in texels)
        full = [t for t in texels if t.reads == most and t.operations == max(t.operations for t in texels)]
    for t in full:
        if t.operations != cost["operations"] or not 0 <= cost["reads"] - t.reads <= t.slack():
            faults.append(f"{model} {name} {t.query}: {t.operations} operations and {t.reads} reads, the formula has "
                          f"{cost['operations']} and {cost['reads']}")
    counted = [t.counted for t in full or texels]
    reads = [t.words for t in full or texels]
    p = {**said["parameters"], "s": said["maps"][0]["channels"], "views": said["views"], "lights": said["lights"]}
    shown = [f"{k} {v}" for k, v in p.items() if k not in ("seed", "error", "sample_width", "sample_height", "stored_blocks")]
    if said["pairs"] < said["views"] * said["lights"]:
        shown.append("pairs missing")
    print(f"| {model} {name} | {', '.join(shown)} | {cost['operations']} | {min(counted)}–{max(counted)} | "
          f"{max(counted) / max(1, cost['operations']):.3f} | {cost['reads']} | {min(reads)}–{max(reads)} | "
          f"{len(full) or 'none'} |", flush=True)
    return faults, bool(full)


def encoded(tools, folder, models):
    """(model, path) of files whose parameters are not those of the vectors."""
    def made(name, *args, **more):
        return sets.write_set(folder / name, *args, **more)

    rgb = made("rgb", sets.RING, sets.GRID, (6, 5))
    grey = made("grey", sets.GRID, sets.RING, (6, 5), 1, missing={(0, 1), (1, 2), (2, 0), (5, 4), (3, 3)})
    two = made("two", [(20, 10), (30, 80)], sets.RING, (5, 5))
    flat = made("flat", [(0, 0)], sets.GRID, (5, 5), wraps=True)
    field = made("field", sets.RING, sets.RING, (24, 20))
    grain = folder / "grain.png"
    run(tools.btfc, "synth", "grain", "-o", grain, "--size", "32x32")
    weave = folder / "weave.exr"
    run(tools.btfc, "synth", "weave", "-o", weave, "--size", "24x24", "--type", "float16")
    short = ["--iterations", "60"]
    statistics = ["--error", "0.05", "--levels"]
    recipes = [
        *(("pca", source, ["--rank", rank, "--precision", p]) for source in (rgb, grey, two) for rank, p in ((0, "f32"), (7, "u8"))),
        *(("pcarf", source, ["--rank", rank, "--precision", p]) for source in (rgb, grey, two) for rank, p in ((0, "u8"), (4, "f16"))),
        *(("lpca", source, ["--rank", rank, "--clusters", c]) for source in (rgb, grey, two) for rank, c in ((0, 3), (5, 2))),
        *(("ptm", source, ["--precision", p]) for source, p in ((rgb, "f16"), (grey, "u8"), (two, "f32"), (flat, "u8"))),
        *(("plm", source, ["--clusters", c, "--polynomial", poly]) for source in (rgb, grey, two)
          for c, poly in ((3, "none"), (2, "histogram"))),
        ("gm", rgb, ["--components", 50, "--mean-brdf", "coded", "--mean-rank", 2, *short]),
        ("gm", grey, ["--components", 9, "--gates", 4, "--mean-brdf", "coded", "--mean-rank", 5, "--shear", "off", *short]),
        ("gm", two, ["--components", 31, "--mean-brdf", "u8", *short]),
        ("gm", flat, ["--components", 6, "--gates", 8, "--mean-brdf", "f32", *short]),
        ("gm", flat, ["--components", 12, "--mean-brdf", "u8", "--transform", "log", *short]),
        *((model, grain, [*statistics, 2, "--order", 1, "--knots", k]) for model in files.FIELDS for k in (0, 16)),
        ("car", grain, ["--error", "0.3", "--levels", 3, "--order", 1]),
        ("car", field, [*statistics, 1, "--order", 1, "--knots", 0, "--clusters", 9, "--range", "5x4"]),
        ("gmrf", field, [*statistics, 3, "--order", 1, "--knots", 7, "--clusters", 4, "--range", "0"]),
        ("car3d", field, [*statistics, 1, "--order", 1, "--knots", 8, "--clusters", 6, "--range", "0"]),
        ("patch", weave, ["--k", 4, "--wb", 9, "--we", 4, "--blend", "liang"]),
        ("patch", weave, ["--k", 4, "--wb", 9, "--we", 4, "--blend", "quilting", "--pack", "packed"]),
        ("patch", grain, ["--k", 5, "--wb", 12, "--we", 5, "--blend", "quilting", "--pack", "packed"]),
    ]
    for number, (model, source, arguments) in enumerate(recipes):
        if model in models:
            path = folder / f"{source.parent.name if source.name == 'set.json' else source.stem}{number}.btfc"
            run(tools.btfc, "encode", source, "-o", path, "--model", model, *arguments)
            yield model, path


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    for tool in ("btfc", "dump", "words"):
        parser.add_argument(f"--{tool}", required=True, type=lambda p: Path(p).resolve())
    parser.add_argument("--glslang", required=True)
    parser.add_argument("--spirv", type=Path, help="folder of what the build ships")
    parser.add_argument("--source", type=Path, default=files.ROOT)
    parser.add_argument("--only", help="one model")
    args = parser.parse_args()
    if shutil.which(args.glslang) is None:
        print(f"no glslang at {args.glslang}: costs are not checked")
        return 0
    models = [m["id"] for m in json.loads(run(args.btfc, "models", "--json"))]
    models = [args.only] if args.only else models
    faults, exact, informed, rng = [], set(), set(), random.Random(5)
    print("| file | parameters | operations | counted | counted / formula | reads | counted | exact texels |\n" + "|---" * 8 + "|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        given = [(m, p) for m in models for p in sorted((args.source / "tests/vectors" / m).glob("*.btfc"))]
        shaders = {m: Shader.compiled(args.glslang, args.source, folder, m) for m in models}
        shipped = {m: Shader.shipped(args.spirv, m) if args.spirv else None for m in models}
        for model, path in sorted([*given, *encoded(args, folder, models)], key=lambda row: models.index(row[0])):
            direct = File(args, folder, path)
            if model not in informed:  # the command takes long to start
                info = json.loads(run(args.btfc, "info", path, "--json"))
                faults += [f"{model}: info says of {k}: {info[k]}" for k in direct.said if info.get(k) != direct.said[k]]
                informed.add(model)
            ways = [direct] if direct.cost["operations"] < MOST_OPERATIONS else []
            if direct.said["unbounded"]:
                ways.append(File(args, folder, path, window_of(direct.said)))
                if direct.cost["operations"] < QUICK:
                    faults += [f"{model} {path.stem}: {f}" for f in outside(ways[-1], direct, shaders[model])]
            for file in ways:
                found, full = check(file, shaders[model], shipped[model], rng)
                faults += found
                exact.update([(model, bool(file.window))] if full else [])
    faults += [f"{m}: the formula was met by no texel" for m in models if (m, False) not in exact]
    faults += [f"{m}: the prepared formula was met by no texel" for m in models if m in files.FIELDS and (m, True) not in exact]
    for fault in faults[:40]:
        print(fault, file=sys.stderr)
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
