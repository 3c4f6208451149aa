"""Model 1, `patch`: spec/models/patch.md.

A texel is decoded twice, independently: decode_texel follows the page's steps on the chunks' bytes with Python
integers; Model.decode_texels does the same for arrays with numpy. Comparing them finds slips of either.
"""

import struct

import numpy as np

from btfc_container import MAX_RAW, Demand, ceil_div, ceil_log2, require

LIANG, QUILTING = 0, 1
NONE, RGBA8, PACKED = 0, 1, 2
FLOAT16 = 2
BLOCK = 1 << 20  # entries checked at once


class Model:
    """What the container asks of a model class: TYPES, a constructor that checks the parameters' rules,
    demands, check_contents, the three sizes and open; then decode_texel and decode_texels, or, with VALUES, value
    and values, which give floats under directions."""

    VALUES = False
    TYPES = frozenset((b"COOR", b"CUTV", b"CUTH", b"SMPL", b"TRIM"))
    NAME = "patch"

    def __init__(self, head, parm):
        self.head = head
        require(len(parm) == 32, "PA1", f"PARM has {len(parm)} bytes")
        (self.m, self.n, self.kx, self.ky, self.w_B, self.w_E, self.blend, self.layout, reserved,
         self.stored_blocks) = struct.unpack("<6I2BHI", parm)
        self.wraps = head.wrap_u == head.wrap_v == 1
        single = self.kx == self.ky == 1 and not self.wraps
        for what, value, least, most in (
                ("sample_width", self.m, 2, 65536), ("sample_height", self.n, 2, 65536),
                ("patch_count_x", self.kx, 1, 2 ** 32), ("patch_count_y", self.ky, 1, 2 ** 32),
                ("patch_size", self.w_B, 2, min(self.m, self.n)),
                ("overlap", self.w_E, 0 if single else 1, self.w_B // 2),
                ("blend", self.blend, 0, 1), ("cut_layout", self.layout, 0, 2), ("reserved", reserved, 0, 0)):
            require(least <= value <= most, "PA1", f"{what} is {value}")
        require((self.blend == LIANG) == (self.layout == NONE), "PA2", "cut_layout does not go with blend")
        require(self.layout != RGBA8 or self.w_E <= 256, "PA2", "overlap above 256 with rgba8")
        self.s = self.w_B - self.w_E
        for what, size, k in (("width", head.width, self.kx), ("height", head.height, self.ky)):
            fits = size == k * self.s if self.wraps else (
                (k - 1) * self.s < size <= k * self.w_B - (k - 1) * self.w_E)
            require(fits, "PA3", f"{what} is {size}")
        require(head.views == head.lights == head.pairs == 1, "PA4", "the model has no directions")
        require(head.wrap_u == head.wrap_v, "PA4", "the texture wraps in one direction only")
        require(head.unbounded == 0, "PA4", "unbounded is set")
        self.narrow = self.m <= 256 and self.n <= 256
        self.b = ceil_log2(self.w_E)
        self.cuts_v, self.cuts_h = (self.kx - 1) * self.ky, self.kx * (self.ky - 1)
        if self.wraps:
            self.cuts_v = self.cuts_h = self.kx * self.ky
        self.block_columns = ceil_div(self.m, 4)
        self.blocks = self.block_columns * ceil_div(self.n, 4)
        self.T = 16 * self.stored_blocks or self.m * self.n
        for d in self.demands():
            require(d.raw_bytes <= MAX_RAW, "PA5", f"{d.name()} would have {d.raw_bytes} bytes")
        require(4 * sum(map(self._plane_words, head.maps)) <= MAX_RAW, "PA5", "the planes are too large")
        require(self.stored_blocks < self.blocks, "PA9", f"stored_blocks is {self.stored_blocks} of {self.blocks}")

    # Sections 2 and 3

    def _cut_bytes(self, cuts):
        if self.layout == NONE:
            return 0
        if self.layout == RGBA8:
            return 4 * cuts * ceil_div(self.w_B, 4)
        return 4 * ceil_div(cuts * self.w_B * self.b, 32)

    def _coor_bytes(self):
        patches = self.kx * self.ky
        return 4 * ceil_div(patches, 2) if self.narrow else 4 * patches

    def demands(self):
        """Every critical chunk but HEAD."""
        rows = [Demand(b"PARM", 32), Demand(b"COOR", self._coor_bytes()),
                Demand(b"CUTV", self._cut_bytes(self.cuts_v)), Demand(b"CUTH", self._cut_bytes(self.cuts_h)),
                Demand(b"TRIM", 4 * ceil_div(self.blocks, 32) if self.stored_blocks else 0)]
        rows += [Demand(b"SMPL", self.T * m.channels * m.bits // 8, part=i) for i, m in enumerate(self.head.maps)]
        return [row for row in rows if row.raw_bytes]

    def formula_bits(self):
        return 8 * sum(d.raw_bytes for d in self.demands())

    def _plane_words(self, m):
        return ceil_div(self.m * self.n * m.bits * (1, 2, 4, 4)[m.channels - 1], 32)

    def memory_bits(self):
        words = (self._coor_bytes() + self._cut_bytes(self.cuts_v) + self._cut_bytes(self.cuts_h)) // 4
        return 32 * (words + sum(map(self._plane_words, self.head.maps)))

    def paper_bits(self):
        bits = self.T * sum(m.channels * m.bits for m in self.head.maps)
        bits += (16 if self.narrow else 32) * self.kx * self.ky + 64
        return bits + (self.cuts_v + self.cuts_h) * self.w_B * self.b if self.blend == QUILTING else bits

    # Contents

    def _coordinates(self, raw):
        """Rows (x, y), one a patch, the unused half of the last word included."""
        return np.frombuffer(raw, "u1" if self.narrow else "<u2").reshape(-1, 2)

    def _entries(self, raw, cut, t):
        """Entry t of a cut, for arrays of both."""
        if self.layout == RGBA8:
            return np.frombuffer(raw, "u1")[cut * (4 * ceil_div(self.w_B, 4)) + t]
        if self.b == 0:
            return np.zeros(np.broadcast(cut, t).shape, np.int64)
        words = np.frombuffer(raw, "<u4")
        bit = (cut * self.w_B + t) * self.b
        low, high = bit >> 5, bit + self.b - 1 >> 5
        pair = words[low].astype(np.uint64) | words[high].astype(np.uint64) << np.uint64(32)
        return (pair >> (bit & 31).astype(np.uint64) & np.uint64((1 << self.b) - 1)).astype(np.int64)

    def check_contents(self, chunk):
        patches = self.kx * self.ky
        coordinates = self._coordinates(chunk(b"COOR"))
        require(not coordinates[patches:].any(), "PA6", "coordinate padding is not 0")
        inside = coordinates[:patches] <= (self.m - self.w_B, self.n - self.w_B)
        require(inside.all(), "PA6", "a patch does not lie inside the sample")
        for kind, cuts in ((b"CUTV", self.cuts_v), (b"CUTH", self.cuts_h)):
            raw = chunk(kind)
            if raw:
                self._check_cuts(kind.decode(), raw, cuts)
        for i, m in enumerate(self.head.maps):
            if m.sample_type == FLOAT16:
                codes = np.frombuffer(chunk(b"SMPL", i), "<u2")
                require(((codes & 0x7C00) != 0x7C00).all(), "PA8", f"map {i} holds a value that is not finite")
        if self.stored_blocks:
            self._check_trim(chunk)

    def _check_trim(self, chunk):
        bits = np.unpackbits(np.frombuffer(chunk(b"TRIM"), "u1"), bitorder="little")
        require(not bits[self.blocks:].any(), "PA9", "unused bits of TRIM are not 0")
        stored = np.nonzero(bits)[0]
        require(len(stored) == self.stored_blocks, "PA9", f"TRIM has {len(stored)} bits set")
        inside_x = stored[:, None] % self.block_columns * 4 + np.arange(4) < self.m
        inside_y = stored[:, None] // self.block_columns * 4 + np.arange(4) < self.n
        outside = ~(inside_y[:, :, None] & inside_x[:, None, :])
        for i, m in enumerate(self.head.maps):
            codes = np.frombuffer(chunk(b"SMPL", i), "u1" if m.bits == 8 else "<u2").reshape(-1, 4, 4, m.channels)
            require(not codes[outside].any(), "PA9", f"map {i}: a texel outside the sample is not 0")

    def _check_cuts(self, name, raw, cuts):
        for first in range(0, cuts * self.w_B, BLOCK):
            t = np.arange(first, min(first + BLOCK, cuts * self.w_B))
            entries = self._entries(raw, t // self.w_B, t % self.w_B)
            require((entries < self.w_E).all(), "PA7", f"an entry of {name} is not below the overlap")
        if self.layout == RGBA8:
            padding = np.frombuffer(raw, "u1").reshape(cuts, -1)[:, self.w_B:].any()
        else:
            used = cuts * self.w_B * self.b % 32
            padding = used and int.from_bytes(raw[-4:], "little") >> used
        require(not padding, "PA7", f"padding of {name} is not 0")

    # Section 4

    def open(self, chunk):
        self.coor, self.cutv, self.cuth = chunk(b"COOR"), chunk(b"CUTV"), chunk(b"CUTH")
        self.trim = chunk(b"TRIM")
        self.smpl = [chunk(b"SMPL", i) for i in range(len(self.head.maps))]

    def decode_texel(self, map_index, x, y):
        return decode_texel(self, map_index, x, y)

    def decode_texels(self, map_index, x, y):
        """Codes for broadcastable arrays of coordinates inside the image; the last axis holds the channels."""
        x, y = np.broadcast_arrays(x, y)
        shape, x, y = x.shape, x.astype(np.int64).ravel(), y.astype(np.int64).ravel()
        i, j = np.minimum(x // self.s, self.kx - 1), np.minimum(y // self.s, self.ky - 1)
        u, v = x - i * self.s, y - j * self.s
        mx, my = (u < self.w_E) & ((i > 0) | self.wraps), (v < self.w_E) & ((j > 0) | self.wraps)
        m = self.head.maps[map_index]
        plane = np.frombuffer(self.smpl[map_index], "u1" if m.bits == 8 else "<u2").reshape(-1, m.channels)
        coordinates = self._coordinates(self.coor)
        stored = np.unpackbits(np.frombuffer(self.trim, "u1"), bitorder="little").astype(bool)
        rank = np.cumsum(stored) - stored

        def texels(i, j, a, b):
            origin = coordinates[j * self.kx + i].astype(np.int64)
            column, row = origin[:, 0] + a, origin[:, 1] + b
            if not self.stored_blocks:
                return plane[row * self.m + column]
            block = (row >> 2) * self.block_columns + (column >> 2)
            out = np.zeros((len(block), m.channels), plane.dtype)
            at = np.nonzero(stored[block])[0]
            out[at] = plane[rank[block[at]] * 16 + (row[at] & 3) * 4 + (column[at] & 3)]
            return out

        blend = self._quilting if self.blend == QUILTING else self._liang
        return blend(texels, m, i, j, u, v, mx, my).reshape(shape + (m.channels,))

    @staticmethod
    def _before(i, k):
        """Columns to the left, or rows above. Only wrapping textures ask for the one before 0."""
        return np.where(i > 0, i, k) - 1

    def _quilting(self, texels, m, i, j, u, v, mx, my):
        def cutv(i, j, v):
            return self._entries(self.cutv, j * self.kx + i if self.wraps else j * (self.kx - 1) + i - 1, v)

        def cuth(i, j, u):
            return self._entries(self.cuth, (j if self.wraps else j - 1) * self.kx + i, u)

        pi, pj, a, b = i.copy(), j.copy(), u.copy(), v.copy()
        at = np.nonzero(mx)[0]
        at = at[u[at] < cutv(i[at], j[at], v[at])]
        pi[at] = self._before(i[at], self.kx)
        a[at] += self.s
        at = np.nonzero(my)[0]
        at = at[v[at] < cuth(pi[at], j[at], a[at])]
        pi[at], a[at] = i[at], u[at]
        pj[at] = self._before(j[at], self.ky)
        b[at] += self.s
        at = at[mx[at]]
        at = at[u[at] < cutv(i[at], pj[at], b[at])]
        pi[at] = self._before(i[at], self.kx)
        a[at] += self.s
        return texels(pi, pj, a, b)

    def _liang(self, texels, m, i, j, u, v, mx, my):
        s = self.s

        def weight(a):
            return ((256 * (2 * a + 1) + self.w_E) // (2 * self.w_E))[:, None]

        def row_at(at, j, b):
            """Step 4a for the row of patches j, at local row b."""
            row = texels(i[at], j, u[at], b)
            both = np.nonzero(mx[at])[0]
            left = texels(self._before(i[at[both]], self.kx), j[both], u[at[both]] + s, b[both])
            row[both] = lerp_arrays(left, row[both], weight(u[at[both]]), m.sample_type)
            return row

        out = row_at(np.arange(len(i)), j, v)
        at = np.nonzero(my)[0]
        above = row_at(at, self._before(j[at], self.ky), v[at] + s)
        out[at] = lerp_arrays(above, out[at], weight(v[at]), m.sample_type)
        return out


def lerp_arrays(a, b, w, sample_type):
    if sample_type != FLOAT16:
        a, b, w = a.astype(np.uint32), b.astype(np.uint32), w.astype(np.uint32)
        return a * (256 - w) + b * w + 128 >> 8
    a, b, w = a.view("<f2").astype(np.float32), b.view("<f2").astype(np.float32), w.astype(np.float32)
    r = ((a * (np.float32(256) - w) + b * w) / np.float32(256)).astype("<f2")
    r[r == 0] = 0
    return r.view("<u2")


def lerp(a, b, w, sample_type):
    """Section 5, on one code."""
    if sample_type != FLOAT16:
        return a * (256 - w) + b * w + 128 >> 8
    a, b = (struct.unpack("<e", struct.pack("<H", code))[0] for code in (a, b))
    # Python's floats hold the exact sum, so packing as binary32 is the one rounding of the page.
    r = struct.unpack("<f", struct.pack("<f", a * (256 - w) + b * w))[0] / 256
    code = struct.unpack("<H", struct.pack("<e", r))[0]
    return 0 if code == 0x8000 else code


def decode_texel(item, map_index, x, y):
    """Section 4, step by step."""
    m, s, w_B, w_E = item.head.maps[map_index], item.s, item.w_B, item.w_E

    def word(raw, q):
        return int.from_bytes(raw[4 * q:4 * q + 4], "little")

    def cut_entry(raw, c, t):
        if item.layout == RGBA8:
            return word(raw, c * ceil_div(w_B, 4) + t // 4) >> 8 * (t % 4) & 255
        first = (c * w_B + t) * item.b
        return sum((word(raw, q // 32) >> q % 32 & 1) << q - first for q in range(first, first + item.b))

    def CUTV(i, j, v):
        return cut_entry(item.cutv, j * item.kx + i if item.wraps else j * (item.kx - 1) + i - 1, v)

    def CUTH(i, j, u):
        return cut_entry(item.cuth, j * item.kx + i if item.wraps else (j - 1) * item.kx + i, u)

    def place(X, Y):
        """The number of the sample's texel (X, Y) in SMPL, None where its block is not stored (section 2.1)."""
        if item.stored_blocks == 0:
            return Y * item.m + X
        block = Y // 4 * ceil_div(item.m, 4) + X // 4
        bits = int.from_bytes(item.trim, "little")
        if not bits >> block & 1:
            return None
        return 16 * bin(bits & (1 << block) - 1).count("1") + 4 * (Y % 4) + X % 4

    def texel(i, j, a, b):
        p = j * item.kx + i
        if item.narrow:
            pair = word(item.coor, p // 2) >> 16 * (p % 2)
            X, Y = pair & 255, pair >> 8 & 255
        else:
            X, Y = word(item.coor, p) & 65535, word(item.coor, p) >> 16
        size = m.bits // 8
        q = place(X + a, Y + b)
        if q is None:
            return [0] * m.channels
        at = q * m.channels * size
        raw = item.smpl[map_index]
        return [int.from_bytes(raw[at + c * size:at + (c + 1) * size], "little") for c in range(m.channels)]

    def mix(a, b, w):
        return [lerp(p, q, w, m.sample_type) for p, q in zip(a, b)]

    def weight(a):
        return (256 * (2 * a + 1) + w_E) // (2 * w_E)

    # 1
    i = min(x // s, item.kx - 1)
    u = x - i * s
    j = min(y // s, item.ky - 1)
    v = y - j * s
    # 2
    mx = u < w_E and (i > 0 or item.wraps)
    my = v < w_E and (j > 0 or item.wraps)
    left = item.kx - 1 if item.wraps and i == 0 else i - 1
    up = item.ky - 1 if item.wraps and j == 0 else j - 1
    # 3
    if item.blend == QUILTING:
        i_t, u_t = (left, u + s) if mx and u < CUTV(i, j, v) else (i, u)
        if not my or v >= CUTH(i_t, j, u_t):
            return texel(i_t, j, u_t, v)
        if mx and u < CUTV(i, up, v + s):
            return texel(left, up, u + s, v + s)
        return texel(i, up, u, v + s)
    # 4
    D = texel(i, j, u, v)
    row = mix(texel(left, j, u + s, v), D, weight(u)) if mx else D
    if not my:
        return row
    B = texel(i, up, u, v + s)
    above = mix(texel(left, up, u + s, v + s), B, weight(u)) if mx else B
    return mix(above, row, weight(v))
