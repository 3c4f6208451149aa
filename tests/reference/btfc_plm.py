"""Model 5, `plm`: spec/models/plm.md."""

import struct

import numpy as np

from btfc_container import Demand, align, ceil_div, require
from btfc_ptm import upper_unit
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words


def lobe(rho, a1, a2, a3, n, u):
    """Step 5, for numbers or arrays of them."""
    base = np.asarray(a1 * u[0] + a2 * u[1] + a3 * u[2], dtype=np.float64)
    live = base > 2.0 ** -40
    exponent = n * np.log2(np.where(live, base, 1.0))
    return np.where(live, np.clip(rho * 2.0 ** np.clip(exponent, -126, 64), -65536, 65536), 0.0)


def polynomial(b, y):
    """Step 6."""
    return ((((b[4] * y + b[3]) * y + b[2]) * y + b[1]) * y + b[0]) * y


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"LOBE", b"INDX", b"POLY"))
    NAME = "plm"
    ARRAY_RULE = "PL3"

    def __init__(self, head, parm):
        require(len(parm) == 8, "PL1", f"PARM has {len(parm)} bytes")
        self.lobe_precision, self.table_precision, self.polynomials, reserved, self.C = struct.unpack("<4BI", parm)
        for what, value, most in (("lobe_precision", self.lobe_precision, 2), ("table_precision", self.table_precision, 2),
                                  ("polynomials", self.polynomials, 1), ("reserved", reserved, 0), ("clusters", self.C, 256)):
            require(value <= most, "PL1", f"{what} is {value}")
        super().__init__(head)
        self.V, self.M = head.views, self.C or self.n
        self.b_l, self.b_t = ELEMENT_BYTES[self.lobe_precision], ELEMENT_BYTES[self.table_precision]
        self.check_sizes("PL2", self._first_words())
        require(row_slots(*self._rows()) <= 3, "PL2", "the rows take more than three slots")

    def _rows(self):
        return (self.V * self.n, self.s, 1) if self.C else (self.V * self.n, 5 * self.s, self.b_l)

    def arrays(self):
        for v in range(self.V):
            yield b"LOBE", 0, v, 5 * self.s, self.M, self.lobe_precision
        if self.polynomials:
            yield b"POLY", 1, 0, 5 * self.s, self.D, self.table_precision

    def demands(self):
        entries = [Demand(b"INDX", align(self.s * self.n, 4), 0, 0, v) for v in range(self.V)] if self.C else []
        return [directions_demand(self.head), Demand(b"PARM", 8)] + self.array_demands() + entries

    def _first_words(self):
        terms = 10 * self.s + ceil_div(5 * self.s * self.D * self.b_t, 4) if self.polynomials else 0
        return (direction_words(self.head) + 10 * self.s * self.V + terms +
                ceil_div(5 * self.s * self.V * self.C * self.b_l, 4))

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(*self._rows()))

    def paper_bits(self):
        return 32 * 5 * self.s * (self.n * self.V + self.D)

    def check_contents(self, chunk):
        super().check_contents(chunk)
        for v in range(self.V if self.C else 0):
            raw = chunk(b"INDX", 0, 0, v)
            require(max(raw[:self.s * self.n]) < self.C, "PL4", f"INDX of view {v}: an entry is out of range")
            require(not any(raw[self.s * self.n:]), "PL4", f"INDX of view {v}: padding is not 0")

    def open(self, chunk):
        super().open(chunk)
        self.entries = [np.frombuffer(chunk(b"INDX", 0, 0, v)[:self.s * self.n], "u1").reshape(self.s, self.n)
                        for v in range(self.V if self.C else 0)]

    def value(self, map_index, x, y, view, light):
        # 1, 2, 3
        t = y * self.head.width + x
        u = upper_unit(light)
        lights = self.directions.lights.corners(light)
        out = []
        for c in self.channels[map_index]:
            total = 0.0
            for v, w in self.directions.views.corners(view):
                # 4, 5
                column = int(self.entries[v][c, t]) if self.C else t
                y_value = float(lobe(*(self.element(b"LOBE", 0, v, m * self.s + c, column) for m in range(5)), u))
                # 6
                if self.polynomials:
                    pairs = [(self.directions.pair(v, l), k) for l, k in lights]
                    b = [sum(k * self.element(b"POLY", 1, 0, j * self.s + c, p) for p, k in pairs) for j in range(5)]
                    y_value = polynomial(b, y_value)
                # 7
                total += w * y_value
            out.append(total)
        return out

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        u, lights, out = upper_unit(light), self.directions.lights.corners(light), []
        for c in self.channels[map_index]:
            total = 0.0
            for v, w in self.directions.views.corners(view):
                column = self.entries[v][c][t] if self.C else t
                found = lobe(*(self.whole[b"LOBE", 0, v][m * self.s + c][column] for m in range(5)), u)
                if self.polynomials:
                    terms = self.whole[b"POLY", 1, 0]
                    pairs = [(self.directions.pair(v, l), k) for l, k in lights]
                    found = polynomial([sum(k * terms[j * self.s + c, p] for p, k in pairs) for j in range(5)], found)
                total = total + w * found
            out.append(total)
        return np.stack(out, -1)
