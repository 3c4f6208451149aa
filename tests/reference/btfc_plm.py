"""Model 5, `plm`: spec/models/plm.md."""

import math
import struct

import numpy as np

from btfc_container import Demand, align, ceil_div, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words, towards

LEAST_BASE, LARGEST = 2.0 ** -40, 65536.0


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"LOBE", b"INDX", b"POLY"))
    NAME = "plm"
    ARRAY_RULE = "PL3"

    def __init__(self, head, parm):
        require(len(parm) == 8, "PL1", f"PARM has {len(parm)} bytes")
        self.lobe_precision, self.table_precision, self.polynomials, reserved, self.C = struct.unpack("<4BI", parm)
        for what, value, most in (("lobe_precision", self.lobe_precision, 2),
                                  ("table_precision", self.table_precision, 2), ("polynomials", self.polynomials, 1),
                                  ("reserved", reserved, 0), ("clusters", self.C, 256)):
            require(value <= most, "PL1", f"{what} is {value}")
        super().__init__(head)
        self.M = self.C or self.n
        self.b_l, self.b_t = ELEMENT_BYTES[self.lobe_precision], ELEMENT_BYTES[self.table_precision]
        self.check_sizes("PL2", self._first_words())
        require(row_slots(*self._rows()) <= 3, "PL2", "the texels take more than three slots")

    def arrays(self):
        for v in range(self.head.views):
            yield (b"LOBE", 0, v, 5 * self.s, self.M, self.lobe_precision)
        if self.polynomials:
            yield (b"POLY", 1, 0, 5 * self.s, self.D, self.table_precision)

    def demands(self):
        index_bytes = align(self.s * self.n, 4) if self.C else 0
        indices = [Demand(b"INDX", index_bytes, tile=v) for v in range(self.head.views if self.C else 0)]
        return [directions_demand(self.head), Demand(b"PARM", 8)] + indices + self.array_demands()

    def _rows(self):
        return (self.head.views * self.n, *((self.s, 1) if self.C else (5 * self.s, self.b_l)))

    def _first_words(self):
        V, s = self.head.views, self.s
        words = direction_words(self.head) + 10 * s * V + ceil_div(5 * s * V * self.C * self.b_l, 4)
        return words + self.polynomials * (10 * s + ceil_div(5 * s * self.D * self.b_t, 4))

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(*self._rows()))

    def paper_bits(self):
        return 32 * 5 * self.s * (self.n * self.head.views + self.D)

    def check_contents(self, chunk):
        super().check_contents(chunk)
        for v in range(self.head.views if self.C else 0):
            indices = np.frombuffer(chunk(b"INDX", tile=v), "u1")
            used = self.s * self.n
            require(bool((indices[:used] < self.C).all()), "PL4", f"an entry of INDX (tile {v}) is out of range")
            require(not indices[used:].any(), "PL4", f"padding of INDX (tile {v}) is not 0")

    def open(self, chunk):
        super().open(chunk)
        self.indices = [chunk(b"INDX", tile=v) for v in range(self.head.views if self.C else 0)]

    def value(self, map_index, x, y, view, light):
        # 1
        t = y * self.head.width + x
        # 2
        views, lights = self.directions.views.corners(view), self.directions.lights.corners(light)
        # 3
        u = towards(light)
        out = []
        for c in self.channels[map_index]:
            def R(a):
                # 4
                column = self.indices[a][c * self.n + t] if self.C else t
                rho, *axis, n = (self.element(b"LOBE", 0, a, i * self.s + c, column) for i in range(5))
                # 5
                base = sum(p * q for p, q in zip(axis, u))
                Y = 0.0
                if base > LEAST_BASE:
                    Y = min(max(rho * 2.0 ** max(min(n * math.log2(base), 64.0), -126.0), -LARGEST), LARGEST)
                # 6
                if not self.polynomials:
                    return Y
                b = [sum(w * self.element(b"POLY", 1, 0, j * self.s + c, self.directions.pair(a, l))
                         for l, w in lights) for j in range(5)]
                return ((((b[4] * Y + b[3]) * Y + b[2]) * Y + b[1]) * Y + b[0]) * Y

            # 7
            out.append(sum(w * R(a) for a, w in views))
        return out

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        u, out = np.array(towards(light)), []
        for c in self.channels[map_index]:
            total = np.zeros(t.shape)
            for a, w in self.directions.views.corners(view):
                column = np.frombuffer(self.indices[a], "u1")[c * self.n + t] if self.C else t
                lobe = self.whole[b"LOBE", 0, a][c::self.s][:, column]
                base = np.tensordot(u, lobe[1:4], 1)
                power = np.clip(lobe[4] * np.log2(np.maximum(base, LEAST_BASE)), -126, 64)
                Y = np.where(base > LEAST_BASE, np.clip(lobe[0] * np.exp2(power), -LARGEST, LARGEST), 0.0)
                if self.polynomials:
                    table = self.whole[b"POLY", 1, 0][c::self.s]
                    b = sum(v * table[:, self.directions.pair(a, l)] for l, v in self.directions.lights.corners(light))
                    Y = sum(b[j] * Y ** (j + 1) for j in range(5))
                total = total + w * Y
            out.append(total)
        return np.moveaxis(np.array(out), 0, -1)
