"""Model 7, `pca`: spec/models/pca.md."""

import struct

import numpy as np

from btfc_container import Demand, ceil_div, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"MEAN", b"IMAG", b"WGHT"))
    NAME = "pca"
    ARRAY_RULE = "PC3"

    def __init__(self, head, parm):
        require(len(parm) == 8, "PC1", f"PARM has {len(parm)} bytes")
        self.k, self.texel_precision, self.table_precision, reserved = struct.unpack("<I2BH", parm)
        for what, value, most in (("rank", self.k, 255), ("texel_precision", self.texel_precision, 2),
                                  ("table_precision", self.table_precision, 2), ("reserved", reserved, 0)):
            require(value <= most, "PC1", f"{what} is {value}")
        super().__init__(head)
        self.b_x, self.b_t = ELEMENT_BYTES[self.texel_precision], ELEMENT_BYTES[self.table_precision]
        self.check_sizes("PC2", self._first_words())
        require(row_slots(self.n, (self.k + 1) * self.s, self.b_x) <= 3, "PC2", "the images take more than three slots")

    def arrays(self):
        image, weight = (self.s, self.n, self.texel_precision), (1, self.D, self.table_precision)
        yield (b"MEAN", 0, 0, *image)
        for j in range(1, self.k + 1):
            yield (b"IMAG", j, 0, *image)
            yield (b"WGHT", j, 0, *weight)

    def demands(self):
        return [directions_demand(self.head), Demand(b"PARM", 8)] + self.array_demands()

    def _first_words(self):
        return (direction_words(self.head) + 2 * ((self.k + 1) * self.s + self.k) +
                ceil_div(self.k * self.D * self.b_t, 4))

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(self.n, (self.k + 1) * self.s, self.b_x))

    def paper_bits(self):
        return 32 * (self.s * self.n * (self.k + 1) + self.k * self.D)

    def value(self, map_index, x, y, view, light):
        # 1
        t = y * self.head.width + x
        # 2
        pairs = self.directions.corners(view, light)
        # 3
        alpha = [sum(w * self.element(b"WGHT", j, 0, 0, p) for p, w in pairs) for j in range(1, self.k + 1)]
        # 4
        return [self.element(b"MEAN", 0, 0, c, t) +
                sum(a * self.element(b"IMAG", j, 0, c, t) for j, a in enumerate(alpha, 1))
                for c in self.channels[map_index]]

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        rows = slice(self.channels[map_index].start, self.channels[map_index].stop)
        p, w = zip(*self.directions.corners(view, light))
        out = self.whole[b"MEAN", 0, 0][rows][:, t]
        for j in range(1, self.k + 1):
            out = out + self.whole[b"WGHT", j, 0][0, list(p)] @ w * self.whole[b"IMAG", j, 0][rows][:, t]
        return np.moveaxis(out, 0, -1)
