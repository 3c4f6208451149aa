"""Files that break the rules of spec/tables.md and of spec/models/car.md, gmrf.md and car3d.md, one rule each, made from the
decode vectors. spec/conformance.md lists them."""

import make_vectors as files
from btf_faults import PAIRS_AT, TRANSFORM_AT, UNBOUNDED_AT, VIEWS_AT, WIDTH_AT, direction_faults, put, with_chunk

# In PARM
LEVELS_AT, PRECISION_AT, BITS_AT, KNOTS_AT, RANGE_AT, ERROR_AT, TORUS_AT, RESERVED_AT, MARGINS_AT, MASKS_AT = (
    4, 5, 6, 7, 8, 16, 20, 21, 24, 40)
ABOVE_32 = 0x4f800001  # the binary32 number after 2^32


def all_bits(value, mask, at=0):
    def change(raw):
        raw[at] = raw[at] & ~mask | value
        return bytes(raw)
    return change


def faults(kind, vectors, open_file):
    """(rule, name, bytes), as btf_faults.faults."""
    chunks = {name: files.read_chunks(data) for name, data in vectors.items()}
    model = {name: open_file(data).model for name, data in vectors.items()}
    yield from direction_faults(chunks, {name: m.head for name, m in model.items()})
    plain, of = chunks["rgb8_f32"], model["rgb8_f32"]

    def parm(at, form, *values, of="rgb8_f32"):
        return with_chunk(chunks[of], b"PARM", put(at, form, *values))

    yield "FD1", "PARM size", with_chunk(plain, b"PARM", lambda raw: bytes(raw) + bytes(4))
    yield "FD1", "PARM shorter than its fixed part", with_chunk(plain, b"PARM", lambda raw: bytes(raw[:39]))
    yield "FD1", "no clusters", parm(0, "<I", 0)
    yield "FD1", "more clusters than pairs", parm(0, "<I", of.D + 1)
    yield "FD1", "no levels", parm(LEVELS_AT, "B", 0)
    yield "FD1", "nine levels", parm(LEVELS_AT, "B", 9)
    yield "FD1", "fewer levels than neighbourhoods", parm(LEVELS_AT, "B", of.P - 1)
    yield "FD1", "precision", parm(PRECISION_AT, "B", 2)
    yield "FD1", "range bits", parm(BITS_AT, "B", 12)
    yield "FD1", "one knot", parm(KNOTS_AT, "B", 1)
    yield "FD1", "65 knots", parm(KNOTS_AT, "B", 65)
    yield "FD1", "range map without columns", parm(RANGE_AT, "<H", 0)
    yield "FD1", "range map without rows", parm(RANGE_AT + 2, "<H", 0)
    yield "FD1", "range map wider than the tile", parm(RANGE_AT, "<H", of.head.width + 1)
    yield "FD1", "range map higher than the tile", parm(RANGE_AT + 2, "<H", of.head.height + 1)
    yield "FD1", "width of no range map", parm(RANGE_AT, "<H", 1, of="single")
    yield "FD1", "height of no range map", parm(RANGE_AT + 2, "<H", 1, of="single")
    yield "FD1", "error below 0", parm(ERROR_AT, "<f", -1e-30)
    yield "FD1", "error above 2^32", parm(ERROR_AT, "<I", ABOVE_32)
    yield "FD1", "error not a number", parm(ERROR_AT, "<f", float("nan"))
    yield "FD1", "PARM reserved", parm(RESERVED_AT + 2, "B", 1)
    if kind == "gmrf":
        yield "FD1", "torus too small for its levels", parm(TORUS_AT, "B", of.P - 2)
        yield "FD1", "torus of 4096 texels", parm(TORUS_AT, "B", 12)
        yield "FD1", "margin of a torus", parm(MARGINS_AT, "<H", 4)
    else:
        yield "FD1", "torus of a recursion", parm(TORUS_AT, "B", 5)
        yield "FD1", "margin 3", parm(MARGINS_AT, "<H", 3)
        yield "FD1", "margin 256", parm(MARGINS_AT + 2, "<H", 256)
        yield "FD1", "margin of a level that is not there", parm(MARGINS_AT + 2 * of.P, "<H", 4)
    yield "FD1", "candidate 40", parm(-1 - 2, "B", 1)

    def head(change):
        return with_chunk(plain, b"HEAD", change)

    yield "FD2", "bounded", head(put(UNBOUNDED_AT, "B", 0))
    yield "FD2", "value transform", head(put(TRANSFORM_AT, "B", 1))
    wide = files.read_chunks(head(put(WIDTH_AT, "<2I", 65536, 65536)))
    yield "FD2", "chunk above 2^27", with_chunk(wide, b"PARM", put(RANGE_AT, "<2H", 65535, 65535))
    if kind == "gmrf":
        yield "FD2", "tori above 2^27", parm(TORUS_AT, "B", 11)
    else:
        many = files.read_chunks(head(put(VIEWS_AT, "<3I", 1000, 1, 1000)))
        long = with_chunk(many, b"PARM", put(MARGINS_AT, f"<{of.P}H", *[255] * of.P))
        yield "FD2", "responses above 2^27", with_chunk(files.read_chunks(long), b"PARM", put(0, "<I", 1000))

    assert of.C == 3 and of.D * of.b % 32
    yield "FD3", "subspace that is not there", with_chunk(plain, b"SIDX", all_bits(3, 3))
    yield "FD3", "subspace without a pair", with_chunk(plain, b"SIDX", lambda raw: bytes(len(raw)))
    yield "FD3", "SIDX padding", with_chunk(plain, b"SIDX", all_bits(0x80, 0x80, -1))

    def relief(at, form, *values, of="rgb8_f32"):
        return with_chunk(chunks[of], b"RMAP", put(at, form, *values))

    yield "FD4", "strength above 1", relief(0, "<f", 1.0000001)
    yield "FD4", "strength below 0", relief(0, "<f", -1e-30)
    yield "FD4", "strength not a number", relief(0, "<f", float("nan"))
    yield "FD4", "step below 0", relief(4, "<f", -1e-30)
    yield "FD4", "step above 65536", relief(4, "<I", 0x47800001)
    yield "FD4", "step infinite", relief(4, "<f", float("inf"))
    yield "FD4", "RMAP padding", relief(-1, "B", 1)
    yield "FD4", "RMAP padding of 16 bits", relief(-2, "<H", 1, of="grey16_f16")

    def number(name, chunk, column, form, *values, level=0):
        size = {"<f": 4, "<I": 4, "<H": 2}[form]
        return with_chunk(chunks[name], chunk, put(size * column, form, *values), level << 8)

    yield "FD5", "f32 not a number", number("rgb8_f32", b"SUBS", 0, "<f", float("nan"))
    yield "FD5", "f32 infinite", number("rgb8_f32", b"FLDS", 0, "<f", float("inf"), level=1)
    yield "FD5", "f32 above 2^32", number("rgb8_f32", b"SUBS", 1, "<I", ABOVE_32)
    yield "FD5", "f16 infinite", number("image_rgb", b"SUBS", 0, "<H", 0xfc00)
    yield "FD5", "f16 not a number", number("image_rgb", b"FLDS", 1, "<H", 0x7e00, level=2)
    for chunk, level, what in ((b"SUBS", 0, "SUBS padding"), (b"FLDS", 0, "FLDS padding")):
        name = next(name for name, m in model.items() for kind_, at, _, rows, columns, precision in m.arrays()
                    if (kind_, at) == (chunk, level) and precision == 1 and rows * columns % 2)
        yield "FD5", what, with_chunk(chunks[name], chunk, put(-1, "B", 1), level << 8)
    d = of.s
    signature = d if of.JOINT else d + d * d
    yield "FD5", "signature's fourth number below 0", number("rgb8_f32", b"SUBS", signature + 3, "<f", -1e-30)
    yield "FD5", "scale below 0", number("rgb8_f32", b"SUBS", signature + 4, "<f", -1.0)
    yield "FD5", "rest below 0", number("rgb8_f32", b"SUBS", signature + 5, "<f", -1e-30)
    if kind != "car3d":
        yield "FD5", "spread below 0", number("rgb8_f32", b"FLDS", 0, "<f", -1e-30)

    def coefficients(*values):
        """Of the first subspace's first field on the coarsest level."""
        return with_chunk(plain, b"FLDS", put(4 * (d * (d + 1) // 2 if of.JOINT else 1), f"<{len(values)}f", *values), 0)

    zeros = (0.0,) * (d * d - 1 if of.JOINT else 0)
    if kind == "gmrf":
        yield "FD6", "spectrum below 0", coefficients(0.75, 0.0)
        yield "FD6", "spectrum 0 in places", coefficients(0.5, 0.0)
        yield "FD6", "spectrum not positive of large coefficients", coefficients(2.0 ** 32, 0.0)
    else:
        yield "FD6", "unstable recursion", coefficients(2.0, *zeros, 0.0)
        yield "FD6", "recursion at the edge of stability", coefficients(1.0, *zeros, 0.0)
        yield "FD6", "recursion that dies away too slowly", coefficients(0.97, *zeros, 0.0)
        yield "FD6", "recursion that overflows", coefficients(2.0 ** 32, *zeros, 2.0 ** 32)
