"""Model 4, `ptm`: spec/models/ptm.md."""

import struct

import numpy as np

from btfc_container import Demand, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words, towards


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"COEF"))
    NAME = "ptm"
    ARRAY_RULE = "PT3"

    def __init__(self, head, parm):
        require(len(parm) == 4, "PT1", f"PARM has {len(parm)} bytes")
        self.precision, *reserved = struct.unpack("<4B", parm)
        require(self.precision <= 2, "PT1", f"precision is {self.precision}")
        require(not any(reserved), "PT1", f"reserved is {reserved}")
        super().__init__(head)
        self.b = ELEMENT_BYTES[self.precision]
        self.check_sizes("PT2", self._first_words())
        slots = row_slots(head.views * self.n, 6 * self.s, self.b)
        require(slots <= 3, "PT2", "the coefficients take more than three slots")

    def arrays(self):
        for level in range(3):
            for v in range(self.head.views):
                yield (b"COEF", level, v, (level + 1) * self.s, self.n, self.precision)

    def demands(self):
        return [directions_demand(self.head), Demand(b"PARM", 4)] + self.array_demands()

    def _first_words(self):
        return direction_words(self.head) + 12 * self.s * self.head.views

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(self.head.views * self.n, 6 * self.s, self.b))

    def paper_bits(self):
        return 32 * 6 * self.s * self.n * self.head.views

    def value(self, map_index, x, y, view, light):
        # 1
        t = y * self.head.width + x
        # 2
        views = self.directions.views.corners(view)
        # 3
        u, v, _ = towards(light)
        out = []
        for c in self.channels[map_index]:
            def R(a):
                # 4
                def row(level, number):
                    return self.element(b"COEF", level, a, number * self.s + c, t)

                a0, a1, a2 = (row(2, i) for i in range(3))
                a3, a4 = (row(1, i) for i in range(2))
                return a0 * u * u + a1 * v * v + a2 * u * v + a3 * u + a4 * v + row(0, 0)

            # 5
            out.append(sum(w * R(a) for a, w in views))
        return out

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        u, v, _ = towards(light)
        terms = ((1,), (u, v), (u * u, v * v, u * v))
        out = []
        for c in self.channels[map_index]:
            out.append(sum(w * term * self.whole[b"COEF", level, a][i * self.s + c][t]
                           for a, w in self.directions.views.corners(view)
                           for level, several in enumerate(terms) for i, term in enumerate(several)))
        return np.moveaxis(np.array(out), 0, -1)
