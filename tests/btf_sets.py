"""Small data sets of BTFs by hand, and queries of files under directions, for make_vectors.py and reference_test.py."""

import json
import math
import random
import struct
from pathlib import Path

import make_vectors as files

RING = [(0, 0), (35, 0), (35, 90), (35, 180), (35, 270)]
GRID = [(0, 0), (40, 20), (40, 140), (40, 260), (75, 20), (75, 80), (75, 140), (75, 200), (75, 260), (75, 320)]
LINE = [(60, 180), (30, 180), (0, 0), (20, 0), (50, 0), (80, 0)]
SIDE = [(10, 40), (30, 10), (30, 75), (55, 25), (55, 60), (78, 45)]
HORIZON = [(0, 0), (90, 0), (90, 120), (90, 240)]


def vector_of(direction):
    theta, phi = (math.radians(angle) for angle in direction)
    return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


def least_height(directions, tables):
    """Of the triangles of directions: rounding moves weights by 2^-21 / height. 1 where there are none."""
    points = []
    for theta, phi in directions:
        r = tables.UNIT * math.tan(math.radians(theta) / 2)
        points.append((round(r * math.cos(math.radians(phi))), round(r * math.sin(math.radians(phi)))))
    heights = [1.0]
    for triangle in tables.triangulate(points)[0]:
        a, b, c = (points[i] for i in triangle)
        heights.append(tables.area(a, b, c) / max(math.dist(a, b), math.dist(b, c), math.dist(c, a)) / tables.UNIT)
    return min(heights)


def write_exr(path, width, height, names, values):
    """Half floats, not compressed, one part; values by texel, channels as named."""
    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data

    order = sorted(range(len(names)), key=lambda i: names[i].encode())
    channels = b"".join(names[i].encode() + b"\0" + struct.pack("<i4xii", 1, 1, 1) for i in order) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<2I", 20000630, 2) + b"".join((
        attribute("channels", "chlist", channels), attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", window), attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", bytes(8)), attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
    )) + b"\0"
    count, size = len(names), 2 * len(names) * width
    offsets = [len(head) + 8 * height + y * (8 + size) for y in range(height)]
    rows = b"".join(struct.pack("<2i", y, size) + b"".join(
        struct.pack(f"<{width}e", *(values[(y * width + x) * count + i] for x in range(width))) for i in order)
        for y in range(height))
    Path(path).write_bytes(head + struct.pack(f"<{height}Q", *offsets) + rows)


def appearance(width, height, channels, view, light, seed, peak=1.0):
    """Values by texel: a diffuse and a glossy part of random strengths, tilted, and noise."""
    rng, noise = random.Random(seed), random.Random(f"{seed} {view} {light}")
    v, l = vector_of(view), vector_of(light)
    out = []
    for _ in range(width * height):
        tilt, gloss = (rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), 1.0), rng.random()
        half = [a + b for a, b in zip(v, l)]
        size = math.sqrt(sum(c * c for c in tilt)) * math.sqrt(sum(c * c for c in half)) + 1e-9
        shine = max(0.0, sum(a * b for a, b in zip(tilt, half)) / size) ** 12
        diffuse = max(0.0, sum(a * b for a, b in zip(tilt, l)))
        for _ in range(channels):
            value = rng.random() * (0.3 + 0.4 * diffuse) + 0.4 * gloss * shine + noise.uniform(-0.03, 0.03)
            out.append(peak * min(1.0, max(0.0, value)))
    return out


def write_image(stem, width, height, channels, sample_type, values):
    """PNG, or floats as TIFF, or as EXR where channels are more than four; returns the file's name."""
    if sample_type == "float16":
        if channels > 4:
            write_exr(f"{stem}.exr", width, height, [f"{420 + 60 * c}" for c in range(channels)], values)
            return f"{stem.name}.exr"
        halves = [struct.unpack("<e", struct.pack("<e", v))[0] for v in values]
        files.write_tiff(f"{stem}.tif", width, height, channels, halves)
        return f"{stem.name}.tif"
    top = (1 << int(sample_type[5:])) - 1
    codes = [round(top * v) for v in values]
    files.write_png(f"{stem}.png", width, height, channels, int(sample_type[5:]), codes)
    return f"{stem.name}.png"


def write_set(folder, views, lights, size, channels=3, sample_type="unorm8", wraps=False, missing=(), seed=1, peak=1.0):
    """A data set described by a JSON file, which is returned. missing: pairs (view, light) to leave out."""
    folder = Path(folder)
    folder.mkdir()
    images = []
    for a, view in enumerate(views):
        for b, light in enumerate(lights):
            if (a, b) in missing:
                continue
            values = appearance(*size, channels, view, light, seed, peak)
            name = write_image(folder / f"v{a}l{b}", *size, channels, sample_type, values)
            images.append({"file": name, "view": list(view), "light": list(light)})
    path = folder / "set.json"
    path.write_text(json.dumps({"images": images, "wraps": wraps}))
    return path


def write_named_set(folder, views, lights, size, missing=()):
    """The same as a directory of 8-bit RGB images with names of UBO2003."""
    folder = Path(folder)
    folder.mkdir()
    number = 0
    for a, (tv, pv) in enumerate(views):
        for b, (tl, pl) in enumerate(lights):
            number += 1
            if (a, b) not in missing:
                stem = folder / f"{number:05} tl{tl:03} pl{pl:03} tv{tv:03} pv{pv:03}"
                write_image(stem, *size, 3, "unorm8", appearance(*size, 3, (tv, pv), (tl, pl), 3))
    return folder


# Queries


def short(values):
    """The nearest binary32 numbers in few digits, as programs of either precision read them alike."""
    return [float(f"{struct.unpack('<f', struct.pack('<f', v))[0]:.9g}") for v in values]


def uncertainty(item, query):
    """How far decoders may differ at a query beside rounding of sums; infinite where either of two answers is right."""
    from btfc_reference import place
    x, y = place(item.head, query["x"], query["y"])
    return float(item.model.uncertainty(query["map"], int(x), int(y), query["view"], query["light"]))


def queries_of(item, count=40, seed=1):
    """Texels and directions of all kinds for a file that the reader has opened."""
    rng, head, directions = random.Random(seed), item.head, item.model.directions
    views, lights = directions.views, directions.lights

    def unit(theta, phi):
        return vector_of((math.degrees(theta), math.degrees(phi)))

    def between(points):
        """Somewhere between measured directions."""
        some = [points.vector(rng.randrange(len(points.points))) for _ in range(3)]
        parts = [rng.random() for _ in some]
        total = [sum(w * d[c] for w, d in zip(parts, some)) for c in range(3)]
        return [c / math.sqrt(sum(t * t for t in total)) for c in total]

    def measured(points):
        return points.vector(rng.randrange(len(points.points)))

    def anywhere(_):
        return unit(math.acos(rng.random()), rng.uniform(0, 2 * math.pi))

    def grazing(_):
        return unit(math.radians(rng.uniform(80, 89.9)), rng.uniform(0, 2 * math.pi))

    def horizon(_):
        phi = rng.choice([0, 90, 180, 270, rng.randrange(360)])
        return [round(c, 9) for c in unit(math.pi / 2, math.radians(phi))]

    def below(_):
        return unit(math.radians(rng.uniform(91, 170)), rng.uniform(0, 2 * math.pi))

    def zero(_):
        return [0.0, 0.0, 0.0]

    def long(points):
        scale = rng.choice([1e-12, 0.01, 3, 1e9])
        return [scale * c for c in between(points)]

    kinds = [measured, between, anywhere, grazing, horizon, below, zero, long]
    out, passed_over = [], 0
    while len(out) < count and passed_over < 20 * count:  # in a damaged file all may be
        number = len(out)
        x, y = rng.randrange(head.width), rng.randrange(head.height)
        if number % 5 == 4:
            x = rng.choice([-1, -head.width - 2, head.width, 2 * head.width + 1, x])
            y = rng.choice([-3, head.height, y])
        if head.unbounded and number % 5 in (2, 3):  # new texels everywhere, to the ends of what can be asked for
            far = [-(1 << 31), (1 << 31) - 1, (1 << 31) - 2, rng.randrange(-(1 << 31), 1 << 31), rng.randrange(-1000, 1000)]
            x, y = rng.choice([*far, x]), rng.choice(far)
        pair = (measured, measured) if number < 4 else (rng.choice(kinds), kinds[number % len(kinds)])
        view, light = pair[0](views), pair[1](lights)
        if number == 3:
            view, light = directions.views.vector(0), directions.lights.vector(0)
        query = {"map": number % len(head.maps), "x": x, "y": y, "view": short(view), "light": short(light)}
        if math.isfinite(uncertainty(item, query)):
            out.append(query)
        else:
            passed_over += 1
    return out


def query_lines(queries):
    """As btfc_dump reads them."""
    return "".join(" ".join(map(repr, [q["map"], q["x"], q["y"], *q["view"], *q["light"]])) + "\n" for q in queries)
