"""Model 2, `gm`: spec/models/gm.md."""

import math
import struct

import numpy as np

from btfc_container import Demand, align, ceil_div, require
from btfc_tables import (ELEMENT_BYTES, MAX_VALUE, U8, Directions, TableModel, array_parts, array_value,
                         array_values, check_array, direction_words, directions_demand, towards)

COMPACT, PAPER = 0, 1
MEAN_F32, MEAN_U8, MEAN_FACTORS = 0, 1, 2
LOG = 2  # value_transform
BYTE = float(np.float32(1 / 255))
LOG2_E = math.log2(math.e)
LARGEST = 126 * math.log(2)  # where values of the logarithm end
ROUNDING = 2.0 ** -22  # of a few operations in binary32


class Model(TableModel):
    """value and values take a footprint too, as no other model does."""

    TYPES = frozenset((b"DIRS", b"MEAN", b"GSCL", b"GMIX"))
    NAME = "gm"

    def __init__(self, head, parm):
        require(len(parm) == 16, "GM1", f"PARM has {len(parm)} bytes")
        (self.M, self.K, self.N, self.layout, self.precision, self.mean_form, self.shear, experts, self.R,
         self.onion, reserved) = struct.unpack("<IH6BH2B", parm)
        rank = (1, 255) if self.mean_form == MEAN_FACTORS else (0, 0)
        paper = self.layout == PAPER
        for what, value, least, most in (
                ("components", self.M, 1, 65536), ("gates", self.K, 0, 32), ("levels", self.N, 1, 1 if paper else 16),
                ("layout", self.layout, 0, 1), ("precision", self.precision, 0, 0 if paper else 2),
                ("mean_form", self.mean_form, 0, 1 if paper else 2), ("shear", self.shear, 0, 0 if paper else 1),
                ("experts", experts, 0, 0), ("mean_rank", self.R, *rank),
                ("onion", self.onion, 0, 1), ("reserved", reserved, 0, 0)):
            require(least <= value <= most, "GM1", f"{what} is {value}")
        require(1 << (self.N - 1) <= self.M, "GM1", f"{self.N} levels of {self.M} components")
        super().__init__(head)
        self.wraps = head.wrap_u == 1
        self.A = 2 * (6 + self.s) + 1 if paper else 13 + self.s + 2 * self.shear
        self.b = ELEMENT_BYTES[self.precision]
        starts = [0] + [ceil_div(self.M, 1 << (self.N - j)) for j in range(1, self.N + 1)]
        self.sizes = [b - a for a, b in zip(starts, starts[1:])]  # m_j

    @staticmethod
    def check_kind(head):
        require(head.channels <= 4, "GM2", f"{head.channels} channels")
        require(head.unbounded == 0, "GM2", "unbounded is set")
        require(head.wrap_u == head.wrap_v, "GM2", "the texture wraps in one direction only")
        require(head.transform in (0, LOG), "GM2", f"value_transform is {head.transform}")

    def _mean_bytes(self):
        if self.mean_form == MEAN_FACTORS:
            return self.R * (4 + self.head.views + self.head.lights * self.s)
        return (4 if self.mean_form == MEAN_F32 else 1) * self.D * self.s

    def demands(self):
        out = [directions_demand(self.head), Demand(b"PARM", 16), Demand(b"MEAN", self._mean_bytes())]
        if self.precision == U8:
            out.append(Demand(b"GSCL", 8 * self.A))
        return out + [Demand(b"GMIX", align(self.A * m * self.b, 4), level) for level, m in enumerate(self.sizes)]

    def memory_bits(self):
        V, L, s = self.head.views, self.head.lights, self.s
        mean = {MEAN_F32: self.D * s, MEAN_U8: ceil_div(self.D * s, 4),
                MEAN_FACTORS: self.R + ceil_div(self.R * V, 4) + ceil_div(self.R * L * s, 4)}[self.mean_form]
        return 32 * (direction_words(self.head) + mean + 20 * self.M)

    def paper_bits(self):
        return 32 * 2 * (6 + self.s) * self.M + self.D * self.s * (32 if self.mean_form == MEAN_F32 else 8)

    def arrays(self):
        for level, m in enumerate(self.sizes):
            yield (b"GMIX", level, 0, self.A, m, self.precision)

    def _coded(self, chunk, level):
        """A level as an array of tables.md 5."""
        return (chunk(b"GSCL") if self.precision == U8 else b"") + chunk(b"GMIX", 0, level)

    def _mean_numbers(self, raw):
        """What MEAN holds as binary32."""
        return np.frombuffer(raw, "<f4", {MEAN_F32: self.D * self.s, MEAN_U8: 0, MEAN_FACTORS: self.R}[self.mean_form])

    def check_contents(self, chunk):
        Directions(self.head, chunk(b"DIRS"))
        for kind, level, _, *shape in self.arrays():
            check_array(self._coded(chunk, level), *shape, "GM3", f"{kind.decode()} (level {level})")
        require(bool((np.abs(self._mean_numbers(chunk(b"MEAN"))) <= MAX_VALUE).all()), "GM3",
                "MEAN: a number is not finite or too large")

        weights = []
        for _, level, _, *shape in self.arrays():
            rows = array_values(self._coded(chunk, level), *shape)

            def within(what, several, least, most):
                require(bool(((least <= several) & (several <= most)).all()), "GM4", f"level {level}: {what}")

            within("mu", rows[:6], -2.0 ** 20, 2.0 ** 20)
            if self.layout == PAPER:
                within("sigma of the inputs", rows[6 + self.s:12 + self.s], 2.0 ** -12, 2.0 ** 30)
                within("sigma of the colours", rows[12 + self.s:-1], 0, MAX_VALUE)
                within("weight", rows[-1], 0, 1)
                weights += rows[-1].tolist()
            else:
                within("log2 sigma", rows[6:12], -12, 30)
                within("p", rows[12], -2.0 ** 10, 2.0 ** 10)
                within("h", rows[13 + self.s:], -2.0 ** 20, 2.0 ** 20)
        require(self.layout != PAPER or any(weights), "GM4", "all weights are 0")

    def open(self, chunk):
        self.directions = Directions(self.head, chunk(b"DIRS"))
        self.raw, self.whole = {}, {}
        for kind, level, tile, *shape in self.arrays():
            raw = self._coded(chunk, level)
            self.raw[kind, level, tile] = raw, shape
            self.whole[kind, level, tile] = array_values(raw, *shape)
        self.mean = chunk(b"MEAN")

    def output_range(self):
        """Section 4: the largest output less the smallest, of any channel, by which decoders may differ."""
        rows = np.hstack(list(self.whole.values()))
        first = 6 if self.layout == PAPER else 13
        return float(np.ptp(rows[first:first + self.s], axis=1).max())

    # One texel, number by number

    def _component(self, m):
        """mu_1 … mu_6, sigma_1 … sigma_6, p, the outputs, h_v and h_l of a component."""
        for key, (raw, shape) in self.raw.items():
            if m < shape[1]:
                break
            m -= shape[1]

        def row(number):
            return array_value(raw, *shape, number, m)

        if self.layout == PAPER:
            sigma = [row(6 + self.s + n) for n in range(6)]
            w = row(self.A - 1)
            p = math.log2(w) - sum(map(math.log2, sigma)) if w > 0 else -math.inf
            return [row(n) for n in range(6)], sigma, p, [row(6 + c) for c in range(self.s)], 0.0, 0.0
        h = [row(13 + self.s), row(14 + self.s)] if self.shear else [0.0, 0.0]
        return ([row(n) for n in range(6)], [2.0 ** row(6 + n) for n in range(6)], row(12),
                [row(13 + c) for c in range(self.s)], *h)

    def _mean_value(self, view, light, c):
        # 9
        if self.mean_form == MEAN_FACTORS:
            V, L, s = self.head.views, self.head.lights, self.s
            total = 0.0
            for r in range(self.R):
                t, = struct.unpack_from("<f", self.mean, 4 * r)
                v = sum(u * struct.unpack_from("b", self.mean, 4 * self.R + r * V + a)[0]
                        for a, u in self.directions.views.corners(view))
                l = sum(w * struct.unpack_from("b", self.mean, self.R * (4 + V) + (r * L + b) * s + c)[0]
                        for b, w in self.directions.lights.corners(light))
                total += t * v * l
            return total
        total = 0.0
        for p, w in self.directions.corners(view, light):
            at = p * self.s + c
            total += w * (struct.unpack_from("<f", self.mean, 4 * at)[0] if self.mean_form == MEAN_F32 else
                          self.mean[at] * BYTE)
        return total

    def value(self, map_index, x, y, view, light, footprint=1):
        # 1
        x, y = x + 0.5, y + 0.5
        # 2, 3
        angles, slopes = [], []
        for d in (view, light):
            dx, dy, dz = towards(d)
            b = math.atan2(dy, dz)
            angles += [math.atan2(dx, math.hypot(dy, dz)), abs(b) if self.onion else b]
            steep = max(dz, 0.2)
            slopes.append((dx / steep, -dy / steep))
        (view_x, view_y), (light_x, light_y) = slopes
        v = (min(footprint, 2.0 ** 20) ** 2 - 1) / 12 if footprint > 1 else 0.0
        l, limits, left, outputs = [], [], [], []
        for m in range(self.M):
            mu, sigma, p, c, h_v, h_l = self._component(m)
            # 4
            dx = x - (mu[0] + h_v * view_x + h_l * light_x)
            dy = y - (mu[1] + h_v * view_y + h_l * light_y)
            if self.wraps:
                dx -= self.head.width * math.floor(dx / self.head.width + 0.5)
                dy -= self.head.height * math.floor(dy / self.head.height + 0.5)
            # 5
            g_x, g_y = 1 + v / sigma[0] ** 2, 1 + v / sigma[1] ** 2
            turned = sum(((angles[n] - mu[2 + n]) / sigma[2 + n]) ** 2 for n in range(4))
            l.append(p - math.log2(g_x * g_y) / 2 -
                     LOG2_E / 2 * (dx * dx / (sigma[0] ** 2 * g_x) + dy * dy / (sigma[1] ** 2 * g_y) + turned))
            limits.append(p + math.log2(sigma[0] * sigma[1]) - LOG2_E / 2 * turned)
            left.append((g_x * g_y) ** -0.5)
            outputs.append(c)
        # 6
        counted = range(self.M)
        if self.K:
            counted = sorted(counted, key=lambda m: (-l[m], m))[:self.K]

        def weighted(exponents, numbers, output):
            # 7
            most = max(exponents[m] for m in numbers)
            W = [2.0 ** (exponents[m] - most) for m in numbers]
            return sum(w * output(m) for m, w in zip(numbers, W)) / sum(W)

        out = []
        for c in self.channels[map_index]:
            # 8
            F = weighted(limits, range(self.M), lambda m: outputs[m][c]) if v else 0.0
            E = weighted(l, counted, lambda m: outputs[m][c] - (1 - left[m]) * F)
            # 10
            T = self._mean_value(view, light, c) + E
            out.append(math.expm1(min(T, LARGEST)) if self.head.transform == LOG else T)
        return out

    # Arrays of texels

    def _mean_values(self, view, light):
        if self.mean_form != MEAN_FACTORS:
            p, w = zip(*self.directions.corners(view, light))
            numbers = (self._mean_numbers(self.mean).astype(float) if self.mean_form == MEAN_F32 else
                       np.frombuffer(self.mean, "u1") * BYTE)
            return w @ numbers.reshape(self.D, self.s)[list(p)]
        V, L, R = self.head.views, self.head.lights, self.R
        t = self._mean_numbers(self.mean).astype(float)
        v = np.frombuffer(self.mean, "i1", R * V, 4 * R).reshape(R, V).astype(float)
        l = np.frombuffer(self.mean, "i1", offset=R * (4 + V)).reshape(R, L, self.s).astype(float)
        (a, u), (b, w) = zip(*self.directions.views.corners(view)), zip(*self.directions.lights.corners(light))
        return (t * (v[:, list(a)] @ u)) @ np.tensordot(l[:, list(b)], w, (1, 0))

    def _mixture(self):
        """As _component, of all components at once."""
        rows = np.hstack(list(self.whole.values()))
        if self.layout == PAPER:
            sigma = rows[6 + self.s:12 + self.s]
            with np.errstate(divide="ignore"):
                p = np.log2(rows[-1]) - np.log2(sigma).sum(0)
            return rows[:6], sigma, p, rows[6:6 + self.s], np.zeros((2, self.M))
        h = rows[13 + self.s:] if self.shear else np.zeros((2, self.M))
        return rows[:6], np.exp2(rows[6:12]), rows[12], rows[13:13 + self.s], h

    def _gates(self, x, y, view, light, v):
        """l_m of the components along a last axis; how far rounding to binary32 may move them; the sum over the
        angles in l_m; g_x and g_y."""
        mu, sigma, p, _, h = self._mixture()
        d = np.array([towards(view), towards(light)])
        b = np.arctan2(d[:, 1], d[:, 2])
        angles = np.stack([np.arctan2(d[:, 0], np.hypot(d[:, 1], d[:, 2])), np.abs(b) if self.onion else b], 1).ravel()
        slope = d[:, :2] * (1, -1) / np.maximum(d[:, 2:], 0.2)
        g = 1 + v / sigma[:2] ** 2
        l = p - np.log2(g).sum(0) / 2
        error = abs(p) + abs(np.log2(sigma)).sum(0)
        for n in range(6):
            place, spread = mu[n], sigma[n]
            size = abs(place) + 2 * math.pi
            if n < 2:
                place, spread = place + slope[:, n] @ h, spread * np.sqrt(g[n])
                size = abs(mu[n]) + abs(slope[:, n]) @ abs(h) + (self.head.width, self.head.height)[n]
                away = np.asarray((x, y)[n])[..., None] + 0.5 - place
            else:
                away = angles[n - 2] - place
            if n < 2 and self.wraps:
                period = (self.head.width, self.head.height)[n]
                away = away - period * np.floor(away / period + 0.5)
            l = l - LOG2_E / 2 * (away / spread) ** 2
            # The square's own rounding, and that of the difference.
            off = size / spread
            error = error + LOG2_E / 2 * ((away / spread) ** 2 + 2 * abs(away / spread) * off + ROUNDING * off ** 2)
        turned = (((angles[:, None] - mu[2:]) / sigma[2:]) ** 2).sum(0)
        return l, ROUNDING * error, turned, g

    def values(self, map_index, x, y, view, light, footprint=1):
        _, sigma, p, outputs, _ = self._mixture()
        v = (min(footprint, 2.0 ** 20) ** 2 - 1) / 12 if footprint > 1 else 0.0
        l, _, turned, g = self._gates(x, y, view, light, v)
        if self.K and self.K < self.M:
            np.put_along_axis(l, np.argsort(-l, axis=-1, kind="stable")[..., self.K:], -np.inf, -1)

        def weights(exponents):
            W = np.exp2(exponents - exponents.max(-1, keepdims=True))
            return W / W.sum(-1, keepdims=True)

        far = outputs @ weights(p + np.log2(sigma[0] * sigma[1]) - LOG2_E / 2 * turned) if v else np.zeros(self.s)
        E = weights(l) @ (outputs - (1 - g.prod(0) ** -0.5) * far[:, None]).T
        T = (E + self._mean_values(view, light))[..., list(self.channels[map_index])]
        return np.expm1(np.minimum(T, LARGEST)) if self.head.transform == LOG else T

    def uncertainty(self, map_index, x, y, view, light):
        """How far the weights of a decoder in binary32 may move values: little unless sigma are small and mu large.
        Infinite where it may count another component (step 6)."""
        l, error, *_ = self._gates(x, y, view, light, 0.0)
        error[np.isneginf(l)] = 0  # layout 1: of weight 0
        undecided = False
        if self.K and self.K < self.M:
            order = np.argsort(-l, axis=-1, kind="stable")
            sorted_l, sorted_error = np.take_along_axis(l, order, -1), np.take_along_axis(error, order, -1)
            inner = (sorted_l - np.maximum(sorted_error, 2.0 ** -15))[..., :self.K].min(-1)
            undecided = (sorted_l + np.maximum(sorted_error, 2.0 ** -15))[..., self.K:].max(-1) >= inner
        counts = l + error >= (l - error).max(-1, keepdims=True) - 24
        moved = 2 * math.log(2) * np.where(counts, error, 0).max(-1)
        out = self.output_range() * np.minimum(moved, 1)
        if self.head.transform == LOG:
            out = np.expm1(np.minimum(out, LARGEST)) * (1 + self.values(map_index, x, y, view, light).max(-1))
        return np.where(undecided, np.inf, out)

    def term_size(self):
        """As of other models: outputs and mean."""
        first, size = 6 if self.layout == PAPER else 13, 0.0
        for key, rows in self.whole.items():
            scales = array_parts(*self.raw[key][:1], *self.raw[key][1])[0]
            sizes = np.abs(rows) + (0 if scales is None else np.abs(scales[:, :1]))
            size = max(size, sizes[first:first + self.s].max())
        numbers = np.abs(self._mean_numbers(self.mean).astype(float))
        size += 128.0 ** 2 * numbers.sum() if self.mean_form == MEAN_FACTORS else numbers.max(initial=1)
        return size * (1 + self.largest()) if self.head.transform == LOG else size
