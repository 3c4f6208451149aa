#!/usr/bin/env python3
"""A second, independent reader of .btfc files, written from the pages under spec/ alone. See README.md.

Exit status: 0 done, 1 the file cannot be read or a self-test failed, 2 usage, 3 invalid file, 5 not supported.
"""

import argparse
import importlib
import json
import random
import sys

import numpy as np

from btfc_container import COLOUR_SPACES, SAMPLE_TYPES, File, Refusal

# Numbers of spec/registry.md with a defined page, and the module that holds the class: `Model`, or the one named.
MODELS = {
    1: "btfc_patch",
    2: "btfc_gm",
    3: "btfc_fields Car",
    4: "btfc_ptm",
    5: "btfc_plm",
    6: "btfc_pcarf",
    7: "btfc_pca",
    8: "btfc_lpca",
    9: "btfc_fields Gmrf",
    10: "btfc_fields Car3d",
}

NORMAL = (0.0, 0.0, 1.0)
BAND = 1 << 20  # texels decoded at once, so that the largest image does not need to fit into memory


def model_class(name):
    module, _, kind = name.partition(" ")
    return getattr(importlib.import_module(module), kind or "Model")


def open_file(stream):
    return File(stream, {number: model_class(name) for number, name in MODELS.items()})


def open_item(stream):
    """What a decoder needs: the contents of META, unknown chunks and padding are not looked at."""
    item = open_file(stream)
    item.model.check_contents(item.chunk)
    item.check_domain()
    item.model.open(item.chunk)
    return item


def inside(coordinate, size, wrap):
    """Section 6: where a coordinate outside the image reads."""
    return coordinate % size if wrap else np.clip(coordinate, 0, size - 1)


def place(head, x, y):
    """Texels as the model sees them."""
    if head.unbounded:
        return x, y
    return inside(x, head.width, head.wrap_u), inside(y, head.height, head.wrap_v)


def decode_texel(item, map_index, x, y):
    """The codes of one texel, by the numbered steps of the model's page."""
    x, y = place(item.head, x, y)
    return item.model.decode_texel(map_index, int(x), int(y))


def value(item, map_index, x, y, view, light):
    """The values of one texel under a view and a light, by the numbered steps of the model's page."""
    x, y = place(item.head, x, y)
    return item.model.value(map_index, int(x), int(y), view, light)


def to_codes(values, sample_type):
    """Section 6: how the values of models but patch are handed out."""
    v = np.asarray(values).astype(np.float32)
    if sample_type == 2:
        return np.clip(v, np.float32(-65504), np.float32(65504)).astype("<f2").view("<u2")
    return np.floor(np.float32((255, 65535)[sample_type]) * np.clip(v, np.float32(0), np.float32(1)) +
                    np.float32(0.5)).astype(("u1", "<u2")[sample_type])


def decode_region(item, map_index, x0, y0, width, height, view=NORMAL, light=NORMAL):
    """Yields bands of rows from the top as arrays (rows, width, channels)."""
    head, rows = item.head, max(1, BAND // width)
    for top in range(y0, y0 + height, rows):
        x = np.arange(x0, x0 + width)[None, :]
        y = np.arange(top, min(top + rows, y0 + height))[:, None]
        x, y = place(head, x, y)
        if item.model.VALUES:
            yield to_codes(item.model.values(map_index, x, y, view, light), head.maps[map_index].sample_type)
        else:
            yield item.model.decode_texels(map_index, x, y)


def check(stream, _):
    open_file(stream).check_contents()
    return {"ok": True, "kind": "ok", "rule": None, "message": "valid"}


def info(stream, _):
    item = open_file(stream)
    head, entries = item.head, item.entries
    stored, index = sum(e.stored_bytes for e in entries), 48 * len(entries)
    return {
        "model": item.model.NAME, "format_version": item.version, "width": head.width, "height": head.height,
        "channels": head.channels,
        "maps": [{"name": m.name, "channels": m.channels, "sample_type": SAMPLE_TYPES[m.sample_type],
                  "colour_space": COLOUR_SPACES[m.colour_space]} for m in head.maps],
        "views": head.views, "lights": head.lights, "pairs": head.pairs,
        "payload_bits": 8 * item.payload_bytes, "formula_bits": item.model.formula_bits(),
        "memory_bits": item.model.memory_bits(), "file_bytes": item.file_bytes,
        "file_max_bytes": item.layout([e.raw_bytes for e in entries])[1], "header_bytes": 64, "index_bytes": index,
        "padding_bytes": item.file_bytes - 64 - index - stored, "stored_bytes": stored,
        "paper_bits": item.model.paper_bits(),
        "chunks": [{"type": e.type.decode(), "level": e.level, "part": e.part, "tile": e.tile,
                    "codec": ("raw", "zstd")[e.codec], "offset": e.offset, "stored_bytes": e.stored_bytes,
                    "raw_bytes": e.raw_bytes} for e in entries],
    }


def decode(stream, args):
    item = open_item(stream)
    names = [m.name for m in item.head.maps]
    if args.map is not None and args.map not in names:
        print(f"no map {args.map!r}; there are: {', '.join(names)}", file=sys.stderr)
        sys.exit(2)
    map_index = names.index(args.map) if args.map is not None else 0
    region = args.region or (0, 0, item.head.width, item.head.height)
    dtype = "u1" if item.head.maps[map_index].bits == 8 else "<u2"
    with open(args.output, "wb") as out:
        for band in decode_region(item, map_index, *region, args.view, args.light):
            out.write(band.astype(dtype, copy=False).tobytes())
    return None


def values(stream, args):
    """The values of queries {"map", "x", "y", "view", "light"}, as little-endian f64."""
    item = open_item(stream)
    if not item.model.VALUES:
        print(f"model {item.model.NAME} gives codes, not values under directions", file=sys.stderr)
        sys.exit(2)
    with open(args.queries, encoding="utf-8") as file:
        queries = json.load(file)
    answers = [value(item, q["map"], q["x"], q["y"], q["view"], q["light"]) for q in queries]
    with open(args.output, "wb") as out:
        out.write(np.array([v for answer in answers for v in answer], "<f8").tobytes())
    return None


def selftest_values(item, count, rng):
    """As below, under 20 views and lights of all kinds."""
    head, (width, height) = item.head, item.model.seen()
    at, largest = np.arange(width * height), item.model.largest()
    for number in range(20):
        view, light = ([rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0.7, 1)] for _ in range(2))
        if number % 4 == 0:
            view, light = (points.vector(rng.randrange(len(points.points)))
                           for points in (item.model.directions.views, item.model.directions.lights))
        for map_index, m in enumerate(head.maps):
            some = rng.choices(at.tolist(), k=max(1, count // 20))
            arrays = item.model.values(map_index, *np.divmod(some, width)[::-1], view, light)
            for t, found in zip(some, arrays.tolist()):
                expected = item.model.value(map_index, t % width, t // width, view, light)
                if max(abs(a - b) for a, b in zip(found, expected)) > item.model.AGREE * largest:
                    return {"ok": False, "map": m.name, "texel": (t % width, t // width), "view": view,
                            "light": light, "scalar": expected, "vector": found}
    return {"ok": True, "compared": count}


def selftest(stream, args):
    item = open_item(stream)
    head, rng = item.head, random.Random(1)
    if item.model.VALUES:
        return selftest_values(item, args.count, rng)
    places = [(rng.randrange(head.width), rng.randrange(head.height)) for _ in range(args.count)]
    x, y = np.array(places, np.int64).reshape(-1, 2).T
    for map_index, m in enumerate(head.maps):
        arrays = item.model.decode_texels(map_index, x, y)
        for texel, codes in zip(places, arrays.tolist()):
            expected = decode_texel(item, map_index, *texel)
            if codes != expected:
                return {"ok": False, "map": m.name, "texel": texel, "scalar": expected, "vector": codes}
    return {"ok": True, "compared": args.count}


def region(text):
    values = [int(part) for part in text.split(",")]
    if len(values) != 4 or min(values[2:]) < 1 or any(abs(value) > 1 << 31 for value in values):
        raise ValueError(text)
    return values


def vector(text):
    parts = [float(part) for part in text.split(",")]
    if len(parts) != 3:
        raise ValueError(text)
    return parts


def main(argv):
    parser = argparse.ArgumentParser(description="Reference reader of .btfc files")
    commands = parser.add_subparsers(dest="command", required=True)
    for function in (check, info, decode, values, selftest):
        command = commands.add_parser(function.__name__)
        command.add_argument("file")
        command.set_defaults(function=function)
    commands.choices["decode"].add_argument("-o", dest="output", required=True, metavar="OUT.raw")
    commands.choices["decode"].add_argument("--map", metavar="NAME")
    commands.choices["decode"].add_argument("--region", type=region, metavar="X,Y,W,H")
    commands.choices["decode"].add_argument("--view", type=vector, metavar="X,Y,Z", default=NORMAL)
    commands.choices["decode"].add_argument("--light", type=vector, metavar="X,Y,Z", default=NORMAL)
    commands.choices["values"].add_argument("queries", metavar="QUERIES.json")
    commands.choices["values"].add_argument("-o", dest="output", required=True, metavar="OUT.f64")
    commands.choices["selftest"].add_argument("--count", type=int, default=2000)
    # argparse takes a value with a leading minus sign for an option unless it is joined to its own.
    for at in range(len(argv) - 1, 0, -1):
        if argv[at - 1] in ("--region", "--view", "--light"):
            argv[at - 1:at + 1] = [argv[at - 1] + "=" + argv[at]]
    args = parser.parse_args(argv)
    try:
        with open(args.file, "rb") as stream:
            answer = args.function(stream, args)
    except Refusal as refusal:
        print(json.dumps({"ok": False, "kind": refusal.kind, "rule": refusal.rule, "message": refusal.message}))
        return 3 if refusal.kind == "invalid" else 5
    except OSError as error:
        print(error, file=sys.stderr)
        return 1
    if answer is not None:
        print(json.dumps(answer))
    return 0 if answer is None or answer.get("ok", True) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
