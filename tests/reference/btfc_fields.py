"""Models 3, 9 and 10, `car`, `gmrf` and `car3d`: spec/models/car.md and the pages beside it.

Fields are the stationary solutions that section 5.2 speaks of, to far below `error`: windows are taken so large that what
they leave out does not count. `value` is the direct form of section 5.3, `values` the recursion over a whole window.

Fields of a level are blocks: of car and gmrf each factor is one of its own, of car3d all channels are one. A block has
coefficients A (subspace, neighbour, q, q) and L (subspace, q, q), q = 1 but of car3d."""

import functools
import math
import struct

import numpy as np

from btfc_container import Demand, ceil_div, ceil_log2, require
from btfc_tables import (ELEMENT_BYTES, Directions, TableModel, array_values, check_array, direction_words,
                         directions_demand, towards)

OFFSETS = [(i % 9 - 4, i // 9 - 4) for i in range(36)] + [(i - 40, 0) for i in range(36, 40)]
REACH, SKEW = 4, 5  # of neighbours; a row begins so many steps after the one above
MOST_NOISE = 5.949
TILE = 128  # noises kept together
LEFT_OUT = 1e-8  # of a response's sum, in the last margin's width of a window
ROOM = 1 << 22  # numbers that a response may take here
SIDE = 64  # of what is looked at to find the largest value


# Section 4


def hash2(x, y, z):
    """Arrays of u32."""
    x, y, z = (v * np.uint32(1664525) + np.uint32(1013904223) for v in (x, y, z))
    x = x + y * z
    y = y + z * x
    z = z + x * y
    x, y, z = (v ^ (v >> np.uint32(16)) for v in (x, y, z))
    x = x + y * z
    y = y + z * x
    return (x ^ (x >> np.uint32(16))) * np.uint32(0x85EBCA6B), y


def ones(x):
    return np.unpackbits(np.ascontiguousarray(x).view(np.uint8).reshape(*x.shape, 4), axis=-1).sum(-1).astype(np.int64)


def noise(x, y, level, g, seed):
    """e at broadcastable arrays of places, any integers."""
    places = 1 << (32 - level)
    x, y = np.broadcast_arrays(np.asarray(x, np.int64) % places, np.asarray(y, np.int64) % places)
    x, y = np.atleast_1d(x).astype(np.uint32), np.atleast_1d(y).astype(np.uint32)
    stream = seed ^ (level * 0x9E3779B9 + g * 0x85EBCA6B & 0xFFFFFFFF)
    h_x, h_y = hash2(x, y, np.full_like(x, stream))
    E = 65536 * ones(h_x) + (h_y >> np.uint32(16)).astype(np.int64) + (h_y % np.uint32(65536)).astype(np.int64) - 1114111
    return (E.astype(np.float32) * np.float32(5.33944733e-06)).astype(np.float64)


# Sections 5.2 and 5.3


def solve(A, offsets, start):
    """The recursion over a window (rows, columns, subspace, q, …), 0 outside, from what the noise gives; in start's
    precision, terms added one after the other. All places with one x + 5 y depend on ones before them only."""
    rows, columns = start.shape[:2]
    A = A.astype(start.dtype)
    q, back = A.shape[2], REACH + SKEW * REACH
    Z = np.zeros((columns + SKEW * (rows - 1) + back, rows + REACH, *start.shape[2:]), start.dtype)
    y = np.arange(rows)
    more = (None,) * (start.ndim - 4)
    terms = [(s, j, A[(None, slice(None), s, slice(None), j, *more)]) for s in range(len(offsets)) for j in range(q)]
    with np.errstate(all="ignore"):
        for t in range(columns + SKEW * (rows - 1)):
            first, last = max(0, -((columns - 1 - t) // SKEW)), min(rows - 1, t // SKEW)
            some = y[first:last + 1]
            total = start[some, t - SKEW * some].copy()
            for s, j, a in terms:
                dx, dy = offsets[s]
                total += a * Z[t + back + dx + SKEW * dy, first + dy + REACH:last + 1 + dy + REACH][:, :, j:j + 1]
            Z[t + back, first + REACH:last + 1 + REACH] = total
    x = np.arange(columns)
    return Z[back + x[None, :] + SKEW * y[:, None], y[:, None] + REACH]


def responses(A, offsets, M, precision):
    """h(dy, dx + M) as (rows, columns, subspace, f, g)."""
    C, _, q, _ = A.shape
    start = np.zeros((M + 1, 2 * M + 1, C, q, q), precision)
    start[0, M] = np.eye(q)
    return solve(A, offsets, start)


def rings(h):
    """The ring of each entry."""
    M = h.shape[0] - 1
    return np.maximum(np.arange(M + 1)[:, None], abs(np.arange(-M, M + 1))[None, :])


# Section 5.4


def taps(x):
    """(place on the coarser lattice, weight) of expand at x."""
    i = x >> 1
    return [(i, 0.5), (i + 1, 0.5)] if x & 1 else [(i - 1, 0.125), (i, 0.75), (i + 1, 0.125)]


def expand_axis(V, axis, first, count, coarse_first):
    """Places first … first + count - 1 along an axis, from a coarser array that begins at coarse_first."""
    x = np.arange(first, first + count)
    at = (x >> 1) - coarse_first
    before, here, after = (np.take(V, at + d, axis) for d in (-1, 0, 1))
    odd = (x & 1).astype(bool).reshape([-1 if a == axis else 1 for a in range(V.ndim)])
    return np.where(odd, (here + after) / 2, (before + 6 * here + after) / 8)


class Car(TableModel):
    TYPES = frozenset((b"DIRS", b"SIDX", b"RMAP", b"SUBS", b"FLDS"))
    NAME = "car"
    ARRAY_RULE = "FD5"
    JOINT = False  # one block of all channels a level
    TORUS = False

    AGREE = 1e-6  # of the largest value: value and values leave out other parts of the plane
    finest = 0  # level loaded

    def __init__(self, head, parm):
        def ranged(what, value, least, most):
            require(least <= value <= most, "FD1", f"{what} is {value}")

        require(len(parm) >= 40, "FD1", f"PARM has {len(parm)} bytes")
        (self.C, self.P, self.precision, self.range_bits, self.K, self.R_x, self.R_y, self.seed, self.error, self.torus,
         *rest) = struct.unpack_from("<I4B2HIf4B8H", parm)
        ranged("levels", self.P, 1, 8)
        self.F = 1 if self.JOINT else head.channels
        require(len(parm) == 40 + 8 * self.P * self.F, "FD1", f"PARM has {len(parm)} bytes")
        super().__init__(head)
        ranged("clusters", self.C, 1, min(head.pairs, 32768))
        ranged("precision", self.precision, 0, 1)
        require(self.range_bits in (0, 8, 16), "FD1", f"range_bits is {self.range_bits}")
        require(self.K == 0 or 2 <= self.K <= 64, "FD1", f"knots is {self.K}")
        least, most = (1, 65536) if self.range_bits else (0, 0)
        ranged("range_width", self.R_x, least, min(most, head.width))
        ranged("range_height", self.R_y, least, min(most, head.height))
        require(0 <= self.error <= 2.0 ** 32, "FD1", f"error is {self.error}")
        ranged("torus_log2", self.torus, *((self.P - 1, 11) if self.TORUS else (0, 0)))
        for value in rest[:3]:
            ranged("reserved", value, 0, 0)
        self.margins = rest[3:]
        for l, M in enumerate(self.margins):
            ranged(f"margin {l}", M, *((4, 255) if l < self.P and not self.TORUS else (0, 0)))
        masks = struct.unpack_from(f"<{self.P * self.F}Q", parm, 40)
        for mask in masks:
            ranged("neighbourhood", mask, 0, (1 << 40) - 1)
        self.neighbours = [[[OFFSETS[i] for i in range(40) if masks[l * self.F + f] >> i & 1] for f in range(self.F)]
                           for l in range(self.P)]
        self.b = ceil_log2(self.C)
        d = self.s
        self.S = d + (0 if self.JOINT else d * d) + 4 + d * (self.P + self.K)
        self.check_sizes("FD2", self._first_words(), self._response_words())

    @staticmethod
    def check_kind(head):
        require(head.unbounded == 1, "FD2", "unbounded is not set")
        require(head.transform == 0, "FD2", "value_transform is set")

    def _numbers(self, l):
        """N_l"""
        n = sum(map(len, self.neighbours[l]))
        return self.s * (self.s + 1) // 2 + self.s ** 2 * n if self.JOINT else self.s + n

    def arrays(self):
        yield (b"SUBS", 0, 0, self.C, self.S, self.precision)
        for l in range(self.P):
            yield (b"FLDS", self.P - 1 - l, 0, self.C, self._numbers(l), self.precision)

    def _range_bytes(self):
        return 8 + 4 * ceil_div(self.R_x * self.R_y * self.range_bits, 32)

    def demands(self):
        out = [directions_demand(self.head), Demand(b"PARM", 40 + 8 * self.P * self.F)]
        if self.b:
            out.append(Demand(b"SIDX", 4 * ceil_div(self.D * self.b, 32)))
        if self.range_bits:
            out.append(Demand(b"RMAP", self._range_bytes()))
        return out + self.array_demands()

    def formula_bits(self):
        def p(n):
            return 32 * ceil_div(n, 32)

        q = 8 * ELEMENT_BYTES[self.precision]
        return (8 * (40 + 8 * self.P * self.F) + p(self.D * self.b) +
                (64 + p(self.R_x * self.R_y * self.range_bits) if self.range_bits else 0) + p(q * self.C * self.S) +
                sum(p(q * self.C * self._numbers(l)) for l in range(self.P)))

    def _first_words(self):
        words = direction_words(self.head) + 4 * self.P + ceil_div(self.D * self.b, 32) + self.C * self.S
        if self.range_bits:
            words += 1 + self.R_x * self.R_y
        of_level = 2 * (self.s if self.TORUS else self.F)
        return words + sum(of_level + self.C * self._numbers(l) for l in range(self.P))

    def _response_words(self):
        d = self.s ** 2 if self.JOINT else self.s
        return sum(self.C * d * (M + 1) * (2 * M + 1) for M in self.margins[:self.P])

    def memory_bits(self):
        return 32 * (self._first_words() + self._response_words())

    def paper_bits(self):
        return None

    # Contents

    def check_contents(self, chunk):
        self.directions = Directions(self.head, chunk(b"DIRS"))
        self._subspaces(chunk)
        if self.range_bits:
            raw = chunk(b"RMAP")
            strength, step = struct.unpack_from("<2f", raw)
            require(0 <= strength <= 1, "FD4", f"strength is {strength}")
            require(0 <= step <= 65536, "FD4", f"step is {step}")
            require(not any(raw[8 + self.R_x * self.R_y * self.range_bits // 8:]), "FD4", "RMAP: padding is not 0")
        for kind, level, _, *shape in self.arrays():
            check_array(chunk(kind, 0, level), *shape, self.ARRAY_RULE, f"{kind.decode()} (level {level})")
        self._read(chunk)
        require(bool((self.signatures[:, 3] >= 0).all()), "FD5", "a signature's fourth number is below 0")
        require(bool((self.scales >= 0).all() and (self.rests >= 0).all()), "FD5", "a scale or rest is below 0")
        for l in range(self.P):
            for offsets, A, L in self.blocks(l):
                require(self.JOINT or bool((L >= 0).all()), "FD5", f"level {l}: a spread is below 0")
        for l in range(self.P):
            for offsets, A, _ in self.blocks(l):
                self.check_stable(l, offsets, A)

    def _subspaces(self, chunk):
        if not self.b:
            return np.zeros(self.D, int)
        bits = np.unpackbits(np.frombuffer(chunk(b"SIDX"), "u1"), bitorder="little")
        of_pair = bits[:self.D * self.b].reshape(self.D, self.b) @ (1 << np.arange(self.b))
        require(bool((of_pair < self.C).all()), "FD3", "SIDX: an entry is not below clusters")
        require(len(set(of_pair.tolist())) == self.C, "FD3", "a subspace has no pair")
        require(not bits[self.D * self.b:].any(), "FD3", "SIDX: padding is not 0")
        return of_pair

    def _read(self, chunk):
        self.whole = {(kind, level, 0): array_values(chunk(kind, 0, level), *shape)
                      for kind, level, _, *shape in self.arrays()}
        d, rows = self.s, self.whole[b"SUBS", 0, 0]
        parts = np.split(rows, np.cumsum([d, 0 if self.JOINT else d * d, 4]), axis=1)
        self.means, self.signatures = parts[0], parts[2]
        self.basis = parts[1].reshape(self.C, d, d) if not self.JOINT else np.tile(np.eye(d), (self.C, 1, 1))
        factors = parts[3].reshape(self.C, d, self.P + self.K)
        self.scales, self.rests, self.tables = np.split(factors, (1, self.P), axis=2)
        self.scales = self.scales[..., 0]

    def open(self, chunk):
        self.directions, self.of_pair = Directions(self.head, chunk(b"DIRS")), self._subspaces(chunk)
        self._read(chunk)
        self.cache, self.boxes = {}, {}
        if self.range_bits:
            raw = chunk(b"RMAP")
            self.strength, step = struct.unpack_from("<2f", raw)
            codes = np.frombuffer(raw, ("u1", "<u2")[self.range_bits // 16], self.R_x * self.R_y, 8)
            self.heights = step * codes.reshape(self.R_y, self.R_x).astype(np.float64)

    def blocks(self, l):
        """(offsets, A, L) of each."""
        rows, d, at = self.whole[b"FLDS", self.P - 1 - l, 0], self.s, 0
        if self.JOINT:
            offsets, T = self.neighbours[l][0], d * (d + 1) // 2
            L = np.zeros((self.C, d, d))
            L[(slice(None), *np.tril_indices(d))] = rows[:, :T]
            return [(offsets, rows[:, T:].reshape(self.C, len(offsets), d, d), L)]
        out = []
        for offsets in self.neighbours[l]:
            n = len(offsets)
            out.append((offsets, rows[:, at + 1:at + 1 + n].reshape(self.C, n, 1, 1), rows[:, at].reshape(self.C, 1, 1)))
            at += 1 + n
        return out

    def check_stable(self, l, offsets, A):
        M = self.margins[l]
        h = abs(responses(A, offsets, M, np.float32).astype(np.float64)).sum(3)  # over f: rows, columns, subspace, g
        G = abs(A).sum((1, 2, 3))[:, None]
        with np.errstate(all="ignore"):
            stable = (h.sum((0, 1)) <= 4096) & ((1 + G) * h[rings(h) >= M - 3].sum(0) <= 0.5)
        require(bool(stable.all()), "FD6", f"level {l}: a recursion does not die away")

    # Fields

    @functools.cached_property
    def exact(self):
        """Of each level and block (offsets, A, L, h in a window so large that the rest does not count, what was left
        out of it as a part of the sum)."""
        out = []
        for l in range(self.P):
            out.append([])
            for offsets, A, L in self.blocks(l):
                M, q = self.margins[l], A.shape[2]
                most = max(M, math.isqrt(ROOM // (2 * self.C * q * q)))
                for R in range(M, most + 1, M):
                    h = responses(A, offsets, R, np.float64)
                    last = abs(h[rings(h) > R - M]).sum((0, 2)).max() / abs(h).sum((0, 1, 3)).max()
                    if last <= LEFT_OUT:
                        break
                out[l].append((offsets, A, L, h, last))
        return out

    @functools.cached_property
    def _kernels(self):
        """Of each level and block the window's margin and sigma h or L h as (subspace, f, place and g)."""
        return [[(h.shape[0] - 1, np.einsum("yxcfk,ckg->cfyxg", h, L).reshape(*h.shape[2:4], -1))
                 for _, _, L, h, _ in blocks] for blocks in self.exact]

    def _noise_tile(self, l, g, i, j):
        key = "noise", l, g, i, j
        if key not in self.cache:
            at = np.arange(TILE)
            self.cache[key] = noise(TILE * i + at[None, :], TILE * j + at[:, None], l, g, self.seed)
        return self.cache[key]

    def _noises(self, x, y, width, height, l, channels):
        """e of a window, (row, column, g)."""
        i, j = x // TILE, y // TILE
        return np.stack([np.vstack([np.hstack([self._noise_tile(l, g, a, b) for a in range(i, (x + width - 1) // TILE + 1)])
                                    for b in range(j, (y + height - 1) // TILE + 1)])
                         [y - TILE * j:, x - TILE * i:][:height, :width] for g in channels], -1)

    def _block_channels(self):
        return [list(range(self.s))] if self.JOINT else [[f] for f in range(self.s)]

    def field_at(self, l, x, y):
        """Y_l of one place as (subspace, factor), by the direct form."""
        if (l, x, y) not in self.cache:
            parts = []
            for channels, (R, K) in zip(self._block_channels(), self._kernels[l]):
                e = self._noises(x - R, y - R, 2 * R + 1, R + 1, l, channels)
                parts.append(K @ e[::-1, ::-1].ravel())
            self.cache[l, x, y] = np.concatenate(parts, 1)
        return self.cache[l, x, y]

    def field_over(self, l, x, y, width, height):
        """Y_l of a window as (row, column, subspace, factor), by the recursion."""
        parts = []
        for channels, (offsets, A, L, h, _) in zip(self._block_channels(), self.exact[l]):
            R = h.shape[0] - 1
            e = self._noises(x - R, y - R, width + 2 * R, height + R, l, channels)
            start = np.einsum("cfg,yxg->yxcf", L, e)
            parts.append(solve(A, offsets, start)[R:, R:R + width])
        return np.concatenate(parts, 3)

    # Section 5.4

    def factors_at(self, l, x, y, m):
        """V_l of one place with the levels below m left out."""
        V = self.field_at(l, x, y) if l >= m else np.zeros((self.C, self.s))
        if l + 1 < self.P:
            V = V + sum(u * w * self.factors_at(l + 1, i, j, m) for j, w in taps(y) for i, u in taps(x))
        return V

    def factors_over(self, l, x, y, width, height, m):
        V = self.field_over(l, x, y, width, height) if l >= m else np.zeros((height, width, self.C, self.s))
        if l + 1 < self.P:
            i, j = (x >> 1) - 1, (y >> 1) - 1
            coarse = self.factors_over(l + 1, i, j, (x + width - 1 >> 1) + 2 - i, (y + height - 1 >> 1) + 2 - j, m)
            V = V + expand_axis(expand_axis(coarse, 0, y, height, j), 1, x, width, i)
        return V

    # Sections 5.5 to 5.7

    def _finest(self, level, footprint):
        m = max(level, self.finest)
        for k in range(self.P):
            if 1 << k <= footprint:
                m = max(m, k)
        return m

    def transformed(self, V, m):
        """t of V (…, subspace, factor)."""
        if self.K == 0:
            return V
        T = self.tables

        def table(z):
            p = np.clip((z + 3) * (self.K - 1) / 6, 0, self.K - 1)
            i = np.minimum(np.floor(p), self.K - 2).astype(int)
            c, f = np.arange(self.C)[:, None], np.arange(self.s)[None, :]
            return T[c, f, i] + (p - i) * (T[c, f, i + 1] - T[c, f, i])

        z = V * self.scales
        if m == 0:
            return table(z)
        away = math.sqrt(3) * self.rests[..., m - 1]
        return 2 / 3 * table(z) + (table(z - away) + table(z + away)) / 6

    def weights_of(self, view, light):
        """(subspace -> weight, the sum of the four weights that are left)."""
        nine = [(self.of_pair[self.directions.pair(a, b)], w * u)
                for a, w in self.directions.views.corners(view) for b, u in self.directions.lights.corners(light)]
        order = sorted(range(len(nine)), key=lambda i: (-nine[i][1], i))
        fifth = nine[order[4]][1] if len(order) > 4 else 0.0
        kept = [(nine[i][0], nine[i][1] - fifth) for i in order[:4]]
        total = sum(w for _, w in kept)
        out = {}
        for k, w in kept:
            out[int(k)] = out.get(int(k), 0.0) + (w / total if total > 1e-6 else 0.25)
        return out, total

    def blended(self, t, view, light):
        """All channels of t (…, subspace, factor)."""
        weights, _ = self.weights_of(view, light)
        above = sum(w * (self.signatures[k] ** 2).sum() for k, w in weights.items())
        mean = sum(w * self.signatures[k, :3] for k, w in weights.items())
        below = (mean ** 2).sum() + sum((w * self.signatures[k, 3]) ** 2 for k, w in weights.items())
        gain = min(max(math.sqrt(above / below), 1.0), 2.0) if below > 0 else 1.0
        return sum(w * (self.means[k] + gain * t[..., k, :] @ self.basis[k].T) for k, w in weights.items())

    def height_at(self, u, v):
        """Arrays of places in texels."""
        i = u * self.R_x / self.head.width - 0.5
        j = v * self.R_y / self.head.height - 0.5
        i0, j0 = np.floor(i), np.floor(j)
        a, b = i - i0, j - j0
        x0, y0 = i0.astype(int) % self.R_x, j0.astype(int) % self.R_y
        x1, y1 = (x0 + 1) % self.R_x, (y0 + 1) % self.R_y
        H = self.heights
        return (1 - b) * ((1 - a) * H[y0, x0] + a * H[y0, x1]) + b * ((1 - a) * H[y1, x0] + a * H[y1, x1])

    def relief(self, x, y, light, level=0):
        """What values are multiplied by."""
        if not self.range_bits:
            return np.ones(np.broadcast_shapes(np.shape(x), np.shape(y)))
        W, H = self.head.width, self.head.height
        u = (np.asarray(x) << level) % W + (1 << level) / 2
        v = (np.asarray(y) << level) % H + (1 << level) / 2
        du, dv = W / (2 * self.R_x), H / (2 * self.R_y)
        p = (self.height_at(u + du, v) - self.height_at(u - du, v)) / (2 * du)
        q = (self.height_at(u, v + dv) - self.height_at(u, v - dv)) / (2 * dv)
        lx, ly, lz = towards(light)
        shade = np.clip((lz + q * ly - p * lx) / np.sqrt(1 + p * p + q * q) / max(lz, 0.1), 0, 2)
        return 1 + self.strength * (shade - 1)

    def value(self, map_index, x, y, view, light, footprint=0):
        m = self._finest(0, footprint)
        out = self.blended(self.transformed(self.factors_at(0, x, y, m), m), view, light) * self.relief(x, y, light)
        return [float(out[c]) for c in self.channels[map_index]]

    def values(self, map_index, x, y, view, light, footprint=0):
        x, y = np.broadcast_arrays(x, y)
        m = self._finest(0, footprint)
        tile = 0, 0, *self.seen()
        box = int(x.min()), int(y.min()), int(x.max()) + 1, int(y.max()) + 1
        if all(tile[i] <= box[i] and box[i + 2] <= tile[i + 2] for i in (0, 1)):
            box = tile
        if (box, m) not in self.boxes:
            self.boxes.clear()
            self.boxes[box, m] = self.transformed(
                self.factors_over(0, box[0], box[1], box[2] - box[0], box[3] - box[1], m), m)
        t = self.boxes[box, m][y - box[1], x - box[0]]
        out = self.blended(t, view, light) * self.relief(x, y, light)[..., None]
        return out[..., list(self.channels[map_index])]

    # What the suite measures by

    def seen(self):
        """A part of the tile, all of it where it is small."""
        return min(self.head.width, SIDE), min(self.head.height, SIDE)

    def largest(self):
        width, height = self.seen()
        y, x = np.divmod(np.arange(width * height), width)
        vectors = [(self.directions.views.vector(v), self.directions.lights.vector(l))
                   for v, l in self.directions.measured()]
        return max(float(abs(self.values(number, x, y, view, light)).max())
                   for number in range(len(self.head.maps)) for view, light in vectors)

    def _left_out(self, l):
        """(subspace, factor): how far a decoder with the file's margins may be off, and the largest size of Y_l."""
        off, size = [], []
        for offsets, A, L, h, last in self.exact[l]:
            M, R = self.margins[l], h.shape[0] - 1
            within = np.zeros_like(h)
            within[:M + 1, R - M:R + M + 1] = responses(A, offsets, M, np.float64)
            total = MOST_NOISE * abs(np.einsum("yxcfk,ckg->yxcfg", h, L)).sum((0, 1, 4))
            rest = last / (1 - last) if last < 0.5 else math.inf
            off.append(MOST_NOISE * abs(np.einsum("yxcfk,ckg->yxcfg", h - within, L)).sum((0, 1, 4)) + rest * total)
            size.append(total)
        return np.concatenate(off, 1), np.concatenate(size, 1)

    def _in_values(self, moved):
        """What moving factors by so much (subspace, factor) does to values at most; infinite where the window of `exact`
        is too small to say."""
        if not np.isfinite(moved).all():
            return math.inf
        if self.K:
            steep = abs(np.diff(self.tables, axis=2)).max(2) * (self.K - 1) / 6
            moved = np.where(moved > 0, moved * self.scales * steep, 0)
        return 4 * float(np.einsum("ckf,cf->ck", abs(self.basis), moved).max())  # gain and relief: 2 each at most

    @functools.cached_property
    def margin_error(self):
        return self._in_values(sum(self._left_out(l)[0] for l in range(self.P)))

    def uncertainty(self, map_index, x, y, view, light):
        """What the margins leave out. Infinite where rounding chooses among pairs of nearly equal weights."""
        close = self.weights_of(view, light)[1] < 0.02
        steep = self.range_bits and self.heights.max() > 1000 * min(self.head.width, self.head.height)
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(y)), math.inf if close or steep else self.margin_error)

    def term_size(self):
        size = sum(self._left_out(l)[1] for l in range(self.P))
        terms = self._in_values(size)
        if self.K:
            terms += 4 * float(np.einsum("ckf,cf->ck", abs(self.basis), abs(self.tables).max(2)).max())
        return 2 * float(abs(self.means).max()) + terms


class Gmrf(Car):
    NAME = "gmrf"
    TORUS = True

    def side(self, l):
        return 1 << (self.torus - l)

    def _response_words(self):
        return sum(self.C * self.s * self.side(l) ** 2 for l in range(self.P))

    def spectrum(self, l, offsets, A):
        """D (subspace, i, j)"""
        N = self.side(l)
        i, j = np.arange(N)[:, None], np.arange(N)[None, :]
        D = np.ones((self.C, N, N))
        for s, (dx, dy) in enumerate(offsets):
            D -= 2 * A[:, s, 0][..., None] * np.cos(2 * math.pi * ((dx * j + dy * i) % N) / N)
        return D

    def check_stable(self, l, offsets, A):
        require(bool((self.spectrum(l, offsets, A) >= 2.0 ** -24).all()), "FD6", f"level {l}: no spectrum")

    def torus_of(self, l):
        """(row, column, subspace, factor)"""
        if l not in self.cache:
            N, parts = self.side(l), []
            for f, (offsets, A, L) in enumerate(self.blocks(l)):
                F = np.fft.fft2(noise(np.arange(N)[None, :], np.arange(N)[:, None], l, f, self.seed))
                F[0, 0] = 0
                parts.append(np.fft.ifft2(L * F / np.sqrt(self.spectrum(l, offsets, A))).real)
            self.cache[l] = np.moveaxis(np.stack(parts, -1), 0, 2)
        return self.cache[l]

    def field_at(self, l, x, y):
        N = self.side(l)
        return self.torus_of(l)[y % N, x % N]

    def field_over(self, l, x, y, width, height):
        N = self.side(l)
        return self.torus_of(l)[np.arange(y, y + height)[:, None] % N, np.arange(x, x + width)[None, :] % N]

    def _left_out(self, l):
        size = abs(self.torus_of(l)).max((0, 1))
        return np.zeros_like(size), size


class Car3d(Car):
    NAME = "car3d"
    JOINT = True
