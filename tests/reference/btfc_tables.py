"""What the models of a BTF share: spec/tables.md. Directions, pairs, corners and coded arrays, in doubles.

The triangulation is exact: Python integers, one empty circle after the other.
"""

import functools
import math
import struct

import numpy as np

from btfc_container import CRITICAL, MAX_RAW, Demand, align, ceil_div, require

F32, F16, U8 = 0, 1, 2
ELEMENT_BYTES = (4, 2, 1)
MAX_DIRECTIONS, MAX_VALUE = 1024, 2.0 ** 32
UNIT = 1 << 24  # of a point's coordinates
FINE = 1 << 36  # what a unit is divided into where a direction is looked up


# Section 1


def directions_demand(head):
    """The chunk DIRS."""
    pairs = 0 if head.pairs == head.views * head.lights else 4 * head.pairs
    return Demand(b"DIRS", 8 * (head.views + head.lights) + pairs, flags=CRITICAL)


def check_head(head):
    """What [V1] says of HEAD; [V2] is the demand above."""
    views, lights, pairs = head.views, head.lights, head.pairs
    require(max(views, lights) <= MAX_DIRECTIONS, "V1", f"{views} views and {lights} lights")
    require(max(views, lights) <= pairs <= views * lights, "V1", f"{pairs} pairs of {views} views and {lights} lights")


class Directions:
    """DIRS, after [V3] and [V4]. The triangulation is made where it is first needed."""

    def __init__(self, head, raw):
        points = list(struct.iter_unpack("<2i", raw[:8 * (head.views + head.lights)]))
        self.views, self.lights = Points(points[:head.views]), Points(points[head.views:])
        for what, several in (("view", self.views.points), ("light", self.lights.points)):
            for i, (X, Y) in enumerate(several):
                require(X * X + Y * Y <= UNIT * UNIT, "V3", f"{what} {i} lies below the horizon")
            require(len(set(several)) == len(several), "V3", f"two {what}s are alike")
        self.full = head.pairs == head.views * head.lights
        if not self.full:
            pairs = list(struct.iter_unpack("<2H", raw[8 * (head.views + head.lights):]))
            self.numbers = {pair: p for p, pair in enumerate(pairs)}
            require(all(v < head.views and light < head.lights for v, light in pairs), "V4", "a pair is out of range")
            require(all(a < b for a, b in zip(pairs, pairs[1:])), "V4", "pairs do not ascend")
            require(len({v for v, _ in pairs}) == head.views, "V4", "a view is in no pair")
            require(len({light for _, light in pairs}) == head.lights, "V4", "a light is in no pair")

    def pair(self, view, light):
        """Section 2: the number of a pair, or of what stands for it."""
        if self.full:
            return view * len(self.lights.points) + light
        if (view, light) not in self.numbers:
            X, Y = self.lights.points[light]
            light = min((l for v, l in self.numbers if v == view),
                        key=lambda l: ((self.lights.points[l][0] - X) ** 2 + (self.lights.points[l][1] - Y) ** 2, l))
        return self.numbers[view, light]

    def measured(self):
        """(view, light) of each pair, in the order of their numbers."""
        if self.full:
            return [(v, l) for v in range(len(self.views.points)) for l in range(len(self.lights.points))]
        return list(self.numbers)

    def corners(self, view, light):
        """(pair, weight) of all pairs that a view and a light look at; the weights sum to 1."""
        return [(self.pair(a, b), u * w) for a, u in self.views.corners(view) for b, w in self.lights.corners(light)]


# Sections 3 and 4


def area(a, b, c):
    """Twice the area of the triangle, positive where it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def square(a, b):
    return (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2


def thin(a, b, p):
    """Whether p lies on the line through a and b but for rounding."""
    return abs(area(a, b, p)) <= 64 * max(abs(b[0] - a[0]), abs(b[1] - a[1]))


def in_circle(a, b, c, d):
    """Positive where d lies inside the circle through the counter-clockwise a, b, c, 0 where it lies on it."""
    rows = [(p[0] - d[0], p[1] - d[1]) for p in (a, b, c)]
    (ax, ay), (bx, by), (cx, cy) = rows
    aa, bb, cc = (x * x + y * y for x, y in rows)
    return aa * (bx * cy - by * cx) - bb * (ax * cy - ay * cx) + cc * (ax * by - ay * bx)


def triangulate(points):
    """(triangles, border) as tuples of point numbers, triangles counter-clockwise."""
    numbers = range(len(points))
    if len(points) == 1:
        return [], [(0, 0)]
    a = max(numbers, key=lambda i: (square(points[0], points[i]), -i))
    b = max(numbers, key=lambda i: (square(points[a], points[i]), -i))
    if all(thin(points[a], points[b], p) for p in points):
        chain = sorted(numbers, key=lambda i: ((points[i][0] - points[a][0]) * (points[b][0] - points[a][0]) +
                                               (points[i][1] - points[a][1]) * (points[b][1] - points[a][1]), i))
        return [], list(zip(chain, chain[1:]))

    # A first side of the hull: no point to its right, none between its ends.
    first = min(numbers, key=lambda i: points[i])
    last = next(i for i in numbers if i != first)
    for i in numbers:
        turn = area(points[first], points[last], points[i])
        if i != first and (turn < 0 or turn == 0 and points[i] < points[last]):
            last = i

    # Left of each side lies one polygon, whose corners are the points of a circle that holds no point.
    triangles, border, done, waiting = [], [], set(), [(first, last)]
    while waiting:
        a, b = waiting.pop()
        if (a, b) in done:
            continue
        left = [i for i in numbers if area(points[a], points[b], points[i]) > 0]
        if not left:
            border.append((b, a))
            done.add((a, b))
            continue
        c = left[0]
        for i in left:
            if in_circle(points[a], points[b], points[c], points[i]) > 0:
                c = i
        rest = [i for i in left if in_circle(points[a], points[b], points[c], points[i]) == 0]
        rest.sort(key=functools.cmp_to_key(lambda i, j: -area(points[b], points[i], points[j])))
        polygon = [a, b] + rest
        sides = list(zip(polygon, polygon[1:] + polygon[:1]))
        done.update(sides)
        waiting += [(j, i) for i, j in sides]
        lowest = min(polygon)
        triangles += [(lowest, i, j) for i, j in sides if lowest not in (i, j)]
    return peeled(points, triangles, border)


def peeled(points, triangles, border):
    """Without the triangles that are thin on a side of the border."""
    left, sides = set(triangles), set(border)
    while True:
        for t in left:
            outer = [(t[i], t[(i + 1) % 3], t[(i + 2) % 3]) for i in range(3) if (t[i], t[(i + 1) % 3]) in sides]
            if any(thin(points[a], points[b], points[c]) for a, b, c in outer):
                break
        else:
            break
        left.remove(t)
        for a, b in ((t[i], t[(i + 1) % 3]) for i in range(3)):
            sides.symmetric_difference_update({(a, b)} if (a, b) in sides else {(b, a)})
    return (list(left), list(sides)) if left else (triangles, border)


class Points:
    """Views or lights."""

    def __init__(self, points):
        self.points = points
        self.fine = [(X * FINE, Y * FINE) for X, Y in points]

    @functools.cached_property
    def triangulation(self):
        return triangulate(self.points)

    def vector(self, i):
        """The unit vector of a point."""
        p, q = self.points[i][0] / UNIT, self.points[i][1] / UNIT
        s = p * p + q * q
        return [2 * p / (1 + s), 2 * q / (1 + s), (1 - s) / (1 + s)]

    def corners(self, d):
        """Section 4: up to three (point number, weight), weight 0 left out."""
        x, y, z = map(float, d)
        z = max(z, 0.0)
        b = math.sqrt(x * x + y * y + z * z) + z if all(map(math.isfinite, (x, y, z))) else math.inf
        p = (x / b, y / b) if 1e-18 <= b <= 1e18 else (0.0, 0.0)
        p = tuple(round(math.ldexp(c, 60)) for c in p)  # in the units of self.fine
        return weights(self._raw_weights(p))

    def _raw_weights(self, p):
        triangles, border = self.triangulation
        for triangle in triangles:
            a, b, c = (self.fine[i] for i in triangle)
            areas = area(b, c, p), area(c, a, p), area(a, b, p)
            if min(areas) >= 0:
                return list(zip(triangle, areas))
        nearest = [(0, 1)], math.inf
        for i, j in border:
            (ax, ay), (bx, by) = self.fine[i], self.fine[j]
            dx, dy = bx - ax, by - ay
            length = dx * dx + dy * dy
            t = min(max(((p[0] - ax) * dx + (p[1] - ay) * dy) / length, 0.0), 1.0) if length else 0.0
            distance = math.hypot(ax + t * dx - p[0], ay + t * dy - p[1]) / (UNIT * FINE)
            distance -= 2.0 ** -21 if 0 < t < 1 else 0
            if distance < nearest[1]:
                nearest = [(i, 1 - t), (j, t)], distance
        return nearest[0]


def towards(d):
    """The unit vector of a light, as the models with a formula of it take it (their pages' step 3)."""
    x, y, z = map(float, d)
    z = max(z, 0.0)
    L = math.hypot(x, y, z)
    return (x / L, y / L, z / L) if 1e-18 <= L <= 1e18 else (0.0, 0.0, 1.0)


def weights(raw):
    raw = [(i, max(w, 0)) for i, w in raw]
    total = sum(w for _, w in raw)
    kept = [(i, w) for i, w in raw if w * 65536 >= total]
    total = sum(w for _, w in kept)
    return [(i, w / total) for i, w in kept]


# Section 5


def array_bytes(rows, columns, precision):
    """B(R, N, p)"""
    if precision == U8:
        return 8 * rows + align(rows * columns, 4)
    return align(ELEMENT_BYTES[precision] * rows * columns, 4)


def array_parts(raw, rows, columns, precision):
    """(offset and step of each row or None, elements, padding)"""
    head = 8 * rows if precision == U8 else 0
    end = head + ELEMENT_BYTES[precision] * rows * columns
    scales = np.frombuffer(raw[:head], "<f4").reshape(rows, 2) if precision == U8 else None
    elements = np.frombuffer(raw[head:end], ("<f4", "<f2", "u1")[precision]).reshape(rows, columns)
    return scales, elements, raw[end:]


def check_array(raw, rows, columns, precision, rule, name):
    scales, elements, padding = array_parts(raw, rows, columns, precision)

    def bounded(values):
        return bool((np.abs(values) <= MAX_VALUE).all())  # false for what is not a number

    require(not any(padding), rule, f"{name}: padding is not 0")
    if precision != U8:
        require(bounded(elements.astype(np.float64)), rule, f"{name}: an element is not finite or too large")
        return
    with np.errstate(all="ignore"):
        ends = scales[:, 0] + np.float32(255) * scales[:, 1]
    require(bounded(scales) and bounded(ends), rule, f"{name}: a scale is not finite or too large")
    require(bool((scales[:, 1] >= 0).all()), rule, f"{name}: a step is below 0")


def array_values(raw, rows, columns, precision):
    """An array of (rows, columns) in double precision."""
    scales, elements, _ = array_parts(raw, rows, columns, precision)
    if precision == U8:
        elements = scales[:, :1] + scales[:, 1:] * elements.astype(np.float32)
    return elements.astype(np.float64)


def array_value(raw, rows, columns, precision, row, column):
    """One element, read from the bytes on its own."""
    at = row * columns + column
    if precision == F32:
        return struct.unpack_from("<f", raw, 4 * at)[0]
    if precision == F16:
        return struct.unpack_from("<e", raw, 2 * at)[0]
    offset, step = struct.unpack_from("<2f", raw, 8 * row)
    return float(np.float32(offset) + np.float32(step) * np.float32(raw[8 * rows + at]))


# Section 7


def direction_words(head):
    product = head.views * head.lights
    return 520 + 16 * (head.views + head.lights) + (product if head.pairs < product else 0)


def rows_per_slot(e, b):
    return MAX_RAW // (e * b)


def row_words(r, e, b):
    if e == 0:
        return 0
    q = rows_per_slot(e, b)
    return r // q * ceil_div(q * e * b, 4) + ceil_div(r % q * e * b, 4)


def row_slots(r, e, b):
    """How many slots the row table takes."""
    return ceil_div(r, rows_per_slot(e, b)) if e else 0


# What the classes of the models have in common.


class TableModel:
    """A model with directions. What a class adds: TYPES, NAME, a constructor that checks its parameters' rules,
    demands, arrays, the sizes, value and values.

    value and values follow the page's section 4 for a texel inside the image: value with the elements as they are
    read one by one from the bytes, values for broadcastable arrays of texels with whole arrays."""

    VALUES = True
    ARRAY_RULE = ""  # the rule that holds the coded arrays
    error = 0.0  # what a file states of its own decoding
    AGREE = 1e-9  # how far value and values may differ, of the largest value

    def __init__(self, head):
        check_head(head)
        self.check_kind(head)
        self.head = head
        self.s, self.n, self.D = head.channels, head.width * head.height, head.pairs
        starts = [0]
        for m in head.maps:
            starts.append(starts[-1] + m.channels)
        self.channels = [range(a, b) for a, b in zip(starts, starts[1:])]  # of each map

    @staticmethod
    def check_kind(head):
        """[V5], in whose place a model may have a rule of its own."""
        require(head.unbounded == 0, "V5", "unbounded is set")
        require(head.transform == 0, "V5", "value_transform is set")

    def arrays(self):
        """(chunk type, level, tile, rows, columns, precision) of every coded array."""
        raise NotImplementedError

    def array_demands(self):
        return [Demand(kind, array_bytes(*shape), level, 0, tile) for kind, level, tile, *shape in self.arrays()]

    def check_sizes(self, rule, *slots):
        """Chunks and the first word slots (in words) within 2^27 bytes."""
        for d in self.demands():
            require(d.raw_bytes <= MAX_RAW, rule, f"{d.name()} would have {d.raw_bytes} bytes")
        for words in slots:
            require(4 * words <= MAX_RAW, rule, f"a word slot would have {words} words")

    def formula_bits(self):
        return 8 * sum(d.raw_bytes for d in self.demands() if d.type != b"DIRS")

    def check_contents(self, chunk):
        Directions(self.head, chunk(b"DIRS"))
        for kind, level, tile, *shape in self.arrays():
            check_array(chunk(kind, 0, level, tile), *shape, self.ARRAY_RULE, f"{kind.decode()} (level {level})")

    def open(self, chunk):
        self.directions = Directions(self.head, chunk(b"DIRS"))
        self.raw, self.whole = {}, {}
        for kind, level, tile, *shape in self.arrays():
            raw = chunk(kind, 0, level, tile)
            self.raw[kind, level, tile] = raw, shape
            self.whole[kind, level, tile] = array_values(raw, *shape)

    def element(self, kind, level, tile, row, column):
        raw, shape = self.raw[kind, level, tile]
        return array_value(raw, *shape, row, column)

    def seen(self):
        """Width and height of the texels that a file's largest value is looked for in."""
        return self.head.width, self.head.height

    def largest(self):
        """The largest size of a value under all measured pairs."""
        y, x = np.divmod(np.arange(self.n), self.head.width)
        most = 0.0
        for v, l in self.directions.measured():
            view, light = self.directions.views.vector(v), self.directions.lights.vector(l)
            for number in range(len(self.head.maps)):
                most = max(most, float(np.abs(self.values(number, x, y, view, light)).max()))
        return most

    def uncertainty(self, map_index, x, y, view, light):
        """By how much more than rounding of sums a decoder's values may be off."""
        return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))

    def term_size(self):
        """The largest sum of the sizes of a value's terms: what rounding errors of odd files are measured by. The
        model is of no use afterwards."""
        for key, values in self.whole.items():
            scales = array_parts(*self.raw[key][:1], *self.raw[key][1])[0]
            # offset + step e may cancel too.
            self.whole[key] = np.abs(values) + (0 if scales is None else np.abs(scales[:, :1]))
        return self.largest()
