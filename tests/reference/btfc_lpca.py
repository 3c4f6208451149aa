"""Model 8, `lpca`: spec/models/lpca.md."""

import struct

import numpy as np

from btfc_container import Demand, align, ceil_div, require
from btfc_tables import ELEMENT_BYTES, TableModel, direction_words, directions_demand, row_slots, row_words


class Model(TableModel):
    TYPES = frozenset((b"DIRS", b"CLUS", b"CMEA", b"CVEC", b"CWGT"))
    NAME = "lpca"
    ARRAY_RULE = "LP3"

    def __init__(self, head, parm):
        require(len(parm) == 12, "LP1", f"PARM has {len(parm)} bytes")
        self.c, self.k, self.texel_precision, self.table_precision, reserved = struct.unpack("<2I2BH", parm)
        for what, value, least, most in (("clusters", self.c, 1, 65536), ("rank", self.k, 0, 255),
                                         ("texel_precision", self.texel_precision, 0, 2),
                                         ("table_precision", self.table_precision, 0, 2), ("reserved", reserved, 0, 0)):
            require(least <= value <= most, "LP1", f"{what} is {value}")
        super().__init__(head)
        self.b_x, self.b_t = ELEMENT_BYTES[self.texel_precision], ELEMENT_BYTES[self.table_precision]
        self.b_c = 1 if self.c <= 256 else 2
        self.check_sizes("LP2", self._first_words())
        require(row_slots(self.n, self.k, self.b_x) <= 1, "LP2", "the weights take more than one slot")
        slots = row_slots(self.c * self.D, (self.k + 1) * self.s, self.b_t)
        require(slots <= 2, "LP2", "the eigenvectors take more than two slots")

    def arrays(self):
        vector, weight = (self.s * self.c, self.D, self.table_precision), (1, self.n, self.texel_precision)
        yield (b"CMEA", 0, 0, *vector)
        for j in range(1, self.k + 1):
            yield (b"CVEC", j, 0, *vector)
            yield (b"CWGT", j, 0, *weight)

    def demands(self):
        clusters = Demand(b"CLUS", align(self.n * self.b_c, 4))
        return [directions_demand(self.head), Demand(b"PARM", 12), clusters] + self.array_demands()

    def _first_words(self):
        return (direction_words(self.head) + 2 * (self.c * (self.k + 1) * self.s + self.k) +
                ceil_div(self.n * self.b_c, 4))

    def memory_bits(self):
        return 32 * (self._first_words() + row_words(self.n, self.k, self.b_x) +
                     row_words(self.c * self.D, (self.k + 1) * self.s, self.b_t))

    def paper_bits(self):
        return 32 * (self.n + self.s * self.c * self.D * (self.k + 1))

    def _clusters(self, raw):
        return np.frombuffer(raw, "u1" if self.b_c == 1 else "<u2")

    def check_contents(self, chunk):
        super().check_contents(chunk)
        clusters = self._clusters(chunk(b"CLUS"))
        require(bool((clusters[:self.n] < self.c).all()), "LP4", "a texel's cluster is out of range")
        require(not clusters[self.n:].any(), "LP4", "padding of CLUS is not 0")

    def open(self, chunk):
        super().open(chunk)
        self.clusters = chunk(b"CLUS")

    def value(self, map_index, x, y, view, light):
        # 1
        t = y * self.head.width + x
        m = int.from_bytes(self.clusters[t * self.b_c:(t + 1) * self.b_c], "little")
        # 2
        pairs = self.directions.corners(view, light)
        out = []
        for c in self.channels[map_index]:
            # 3
            F = [sum(w * self.element(b"CVEC" if j else b"CMEA", j, 0, m * self.s + c, p) for p, w in pairs)
                 for j in range(self.k + 1)]
            # 4
            out.append(F[0] + sum(self.element(b"CWGT", j, 0, 0, t) * F[j] for j in range(1, self.k + 1)))
        return out

    def values(self, map_index, x, y, view, light):
        t = np.asarray(y) * self.head.width + np.asarray(x)
        m = self._clusters(self.clusters)[t].astype(np.int64)
        p, w = zip(*self.directions.corners(view, light))
        out = []
        for c in self.channels[map_index]:
            def shown(kind, j):
                return (self.whole[kind, j, 0][c::self.s][:, list(p)] @ w)[m]

            out.append(shown(b"CMEA", 0) + sum(self.whole[b"CWGT", j, 0][0, t] * shown(b"CVEC", j)
                                               for j in range(1, self.k + 1)))
        return np.moveaxis(np.array(out), 0, -1)
