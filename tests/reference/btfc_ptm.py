"""Model 4, `ptm`: spec/models/ptm.md."""

import math

import numpy as np

from btfc_container import Demand, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words

# Section 2: the row that each coefficient a0 … a5 begins at, in units of the channels, with its level.
PLACES = ((2, 0), (2, 1), (2, 2), (1, 0), (1, 1), (0, 0))


def upper_unit(d):
    """Step 3: the unit vector with z not below 0; the normal for what has no direction."""
    x, y, z = map(float, d)
    z = max(z, 0.0)
    length = math.sqrt(x * x + y * y + z * z) if all(map(math.isfinite, (x, y, z))) else math.inf
    return (x / length, y / length, z / length) if 1e-18 <= length <= 1e18 else (0.0, 0.0, 1.0)


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"COEF"))
    NAME = "ptm"
    ARRAY_RULE = "PT3"

    def __init__(self, head, parm):
        require(len(parm) == 4, "PT1", f"PARM has {len(parm)} bytes")
        self.precision = parm[0]
        require(self.precision <= 2, "PT1", f"precision is {self.precision}")
        require(not any(parm[1:]), "PT1", "reserved is not 0")
        super().__init__(head)
        self.V, self.b = head.views, ELEMENT_BYTES[self.precision]
        self.check_sizes("PT2", self._first_words())
        require(row_slots(self.V * self.n, 6 * self.s, self.b) <= 3, "PT2", "the rows take more than three slots")

    def arrays(self):
        for level in range(3):
            for v in range(self.V):
                yield b"COEF", level, v, (level + 1) * self.s, self.n, self.precision

    def demands(self):
        return [directions_demand(self.head), Demand(b"PARM", 4)] + self.array_demands()

    def _first_words(self):
        return direction_words(self.head) + 12 * self.s * self.V

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(self.V * self.n, 6 * self.s, self.b))

    def paper_bits(self):
        return 32 * 6 * self.s * self.n * self.V

    @staticmethod
    def _terms(light):
        u, v, _ = upper_unit(light)
        return u * u, v * v, u * v, u, v, 1.0

    def value(self, map_index, x, y, view, light):
        # 1, 2, 3
        t = y * self.head.width + x
        views, terms = self.directions.views.corners(view), self._terms(light)
        # 4, 5
        return [sum(w * sum(f * self.element(b"COEF", level, v, row * self.s + c, t)
                            for f, (level, row) in zip(terms, PLACES)) for v, w in views)
                for c in self.channels[map_index]]

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        out, terms = 0.0, self._terms(light)
        channels = self.channels[map_index]
        for v, w in self.directions.views.corners(view):
            for f, (level, row) in zip(terms, PLACES):
                first = row * self.s + channels.start
                out = out + w * f * self.whole[b"COEF", level, v][first:first + len(channels)][:, t]
        return np.moveaxis(out, 0, -1)
