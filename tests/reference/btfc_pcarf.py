"""Model 6, `pcarf`: spec/models/pcarf.md."""

import struct

import numpy as np

from btfc_container import Demand, ceil_div, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"MEAN", b"IMAG", b"WGHT"))
    NAME = "pcarf"
    ARRAY_RULE = "PF3"

    def __init__(self, head, parm):
        require(len(parm) == 8, "PF1", f"PARM has {len(parm)} bytes")
        self.k, self.texel_precision, self.table_precision, reserved = struct.unpack("<I2BH", parm)
        for what, value, most in (("rank", self.k, 255), ("texel_precision", self.texel_precision, 2),
                                  ("table_precision", self.table_precision, 2), ("reserved", reserved, 0)):
            require(value <= most, "PF1", f"{what} is {value}")
        super().__init__(head)
        self.b_x, self.b_t = ELEMENT_BYTES[self.texel_precision], ELEMENT_BYTES[self.table_precision]
        self.check_sizes("PF2", self._first_words())
        slots = row_slots(head.views * self.n, (self.k + 1) * self.s, self.b_x)
        require(slots <= 3, "PF2", "the images take more than three slots")

    def arrays(self):
        image, weight = (self.s, self.n, self.texel_precision), (1, self.D, self.table_precision)
        for j in range(self.k + 1):
            for v in range(self.head.views):
                yield (b"IMAG" if j else b"MEAN", j, v, *image)
            if j:
                yield (b"WGHT", j, 0, *weight)

    def demands(self):
        return [directions_demand(self.head), Demand(b"PARM", 8)] + self.array_demands()

    def _first_words(self):
        return (direction_words(self.head) + 2 * (self.head.views * (self.k + 1) * self.s + self.k) +
                ceil_div(self.k * self.D * self.b_t, 4))

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(self.head.views * self.n, (self.k + 1) * self.s, self.b_x))

    def paper_bits(self):
        return 32 * (self.head.views * self.s * self.n * (self.k + 1) + self.k * self.D)

    def value(self, map_index, x, y, view, light):
        # 1
        t = y * self.head.width + x
        # 2
        views, lights = self.directions.views.corners(view), self.directions.lights.corners(light)
        out = [0.0] * len(self.channels[map_index])
        for v, u in views:
            # 3
            pairs = [(self.directions.pair(v, l), w) for l, w in lights]
            alpha = [sum(w * self.element(b"WGHT", j, 0, 0, p) for p, w in pairs) for j in range(1, self.k + 1)]
            # 4
            for i, c in enumerate(self.channels[map_index]):
                out[i] += u * (self.element(b"MEAN", 0, v, c, t) +
                               sum(a * self.element(b"IMAG", j, v, c, t) for j, a in enumerate(alpha, 1)))
        return out

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        rows = slice(self.channels[map_index].start, self.channels[map_index].stop)
        out = 0.0
        for v, u in self.directions.views.corners(view):
            out = out + u * self.whole[b"MEAN", 0, v][rows][:, t]
            for j in range(1, self.k + 1):
                alpha = sum(w * self.whole[b"WGHT", j, 0][0, self.directions.pair(v, l)]
                            for l, w in self.directions.lights.corners(light))
                out = out + u * alpha * self.whole[b"IMAG", j, v][rows][:, t]
        return np.moveaxis(out, 0, -1)
