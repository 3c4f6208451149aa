"""Files that break the rules of spec/tables.md and spec/models/gm.md, one rule each, made from the decode vectors.
spec/conformance.md lists them."""

import struct

import make_vectors as files
from btf_faults import TRANSFORM_AT, UNBOUNDED_AT, direction_faults, put, with_chunk

WRAP_V_AT, MAP_COUNT_AT = 27, 24  # in HEAD
# In PARM
GATES_AT, LEVELS_AT, LAYOUT_AT, PRECISION_AT, MEAN_FORM_AT, SHEAR_AT, EXPERTS_AT, RANK_AT, RESERVED_AT = (
    4, 6, 7, 8, 9, 10, 11, 12, 14)
ABOVE_32 = 0x4f800001  # the binary32 number after 2^32


def second_map(raw):
    """Two maps of together five channels."""
    raw[MAP_COUNT_AT:MAP_COUNT_AT + 2] = 2, 5
    more = bytearray(raw[32:64])
    more[:25] = b"more".ljust(24, b"\0") + bytes([5 - raw[56]])
    return bytes(raw + more)


def after(value, towards):
    """The next binary32 number from value, as four bytes."""
    code, = struct.unpack("<I", struct.pack("<f", value))
    return struct.pack("<I", code + (1 if (towards > value) == (value > 0) else -1))


def faults(vectors, open_file):
    """(rule, name, bytes), as btf_faults.faults."""
    chunks = {name: files.read_chunks(data) for name, data in vectors.items()}
    model = {name: open_file(data).model for name, data in vectors.items()}
    yield from direction_faults(chunks, {name: m.head for name, m in model.items()})

    def parm(at, form, *values, of="rgb8_f32"):
        return with_chunk(chunks[of], b"PARM", put(at, form, *values))

    yield "GM1", "PARM size", with_chunk(chunks["rgb8_f32"], b"PARM", lambda raw: bytes(raw) + bytes(4))
    yield "GM1", "no components", parm(0, "<I", 0)
    yield "GM1", "65537 components", parm(0, "<I", 65537)
    yield "GM1", "33 gates", parm(GATES_AT, "<H", 33)
    yield "GM1", "no levels", parm(LEVELS_AT, "B", 0)
    yield "GM1", "17 levels", parm(0, "<IHB", 65536, 0, 17)
    yield "GM1", "more levels than doublings", parm(LEVELS_AT, "B", model["rgb8_f32"].M.bit_length() + 1)
    yield "GM1", "layout", parm(LAYOUT_AT, "B", 2)
    yield "GM1", "precision", parm(PRECISION_AT, "B", 3)
    yield "GM1", "mean form", parm(MEAN_FORM_AT, "B", 3)
    yield "GM1", "shear", parm(SHEAR_AT, "B", 2)
    yield "GM1", "experts", parm(EXPERTS_AT, "B", 1)
    yield "GM1", "mean rank of a table", parm(RANK_AT, "<H", 1)
    yield "GM1", "mean rank 0", parm(RANK_AT, "<H", 0, of="line_wraps")
    yield "GM1", "mean rank 256", parm(RANK_AT, "<H", 256, of="line_wraps")
    yield "GM1", "onion", parm(RESERVED_AT, "B", 2)
    yield "GM1", "PARM reserved", parm(RESERVED_AT + 1, "B", 1)
    yield "GM1", "layout paper with f16", parm(PRECISION_AT, "B", 1, of="paper")
    yield "GM1", "layout paper with u8", parm(PRECISION_AT, "B", 2, of="paper")
    yield "GM1", "layout paper with shear", parm(SHEAR_AT, "B", 1, of="paper")
    yield "GM1", "layout paper with two levels", parm(LEVELS_AT, "B", 2, of="paper")
    yield "GM1", "layout paper with factors", parm(MEAN_FORM_AT, "<3BH", 2, 0, 0, 1, of="paper")

    def head(change):
        return with_chunk(chunks["rgb8_f32"], b"HEAD", change)

    yield "GM2", "five channels", head(second_map)
    yield "GM2", "unbounded", head(put(UNBOUNDED_AT, "B", 1))
    yield "GM2", "wrapping one way", head(put(WRAP_V_AT, "B", 1))
    yield "GM2", "value transform srgb", head(put(TRANSFORM_AT, "B", 1))

    def mixture(name, row, form, *values, level=0, component=0):
        """A number of a component changed."""
        size = {"<f": 4, "<I": 4, "<H": 2}[form]
        at = size * (row * model[name].sizes[level] + component)
        return with_chunk(chunks[name], b"GMIX", put(at, form, *values), level << 8)

    def scale(row, form, *values, of="line_wraps"):
        return with_chunk(chunks[of], b"GSCL", put(8 * row, form, *values))

    # The rows of outputs have no rule beside GM3.
    yield "GM3", "f32 not a number", mixture("rgb8_f32", 13, "<f", float("nan"))
    yield "GM3", "f32 infinite", mixture("rgb8_f32", 15, "<f", float("-inf"), level=2, component=1)
    yield "GM3", "f32 above 2^32", mixture("rgb8_f32", 14, "<I", ABOVE_32)
    yield "GM3", "f16 infinite", mixture("grey16_f16", 13, "<H", 0x7c00)
    yield "GM3", "f16 not a number", mixture("grey16_f16", 13, "<H", 0xfe00)
    yield "GM3", "u8 offset not a number", scale(13, "<f", float("nan"))
    yield "GM3", "u8 offset below -2^32", scale(13, "<I", ABOVE_32 | 1 << 31)
    yield "GM3", "u8 step below 0", scale(13, "<2f", 0.5, -1e-30)
    yield "GM3", "u8 step above 2^32", scale(13, "<2f", -2.0 ** 32, 2.0 ** 33)
    yield "GM3", "u8 end above 2^32", scale(13, "<2f", 2.0 ** 31, 2.0 ** 24)
    for name, what in (("few_float16", "f16 padding"), ("log_wraps", "u8 padding")):
        assert model[name].A * model[name].sizes[0] * model[name].b % 4
        yield "GM3", what, with_chunk(chunks[name], b"GMIX", put(-1, "B", 1), 0)
    yield "GM3", "mean not a number", with_chunk(chunks["rgb8_f32"], b"MEAN", put(0, "<f", float("nan")))
    yield "GM3", "mean infinite", with_chunk(chunks["rgb8_f32"], b"MEAN", put(-4, "<f", float("inf")))
    yield "GM3", "mean above 2^32", with_chunk(chunks["rgb8_f32"], b"MEAN", put(4, "<I", ABOVE_32))
    yield "GM3", "mean factor infinite", with_chunk(chunks["line_wraps"], b"MEAN", put(4, "<f", float("-inf")))

    def number(name, row, value, towards, **more):
        return mixture(name, row, "<I", *struct.unpack("<I", after(value, towards)), **more)

    last = {"level": 2, "component": model["rgb8_f32"].sizes[2] - 1}
    yield "GM4", "mu above 2^20", number("rgb8_f32", 0, 2.0 ** 20, 2.0 ** 21)
    yield "GM4", "mu below -2^20", number("rgb8_f32", 5, -2.0 ** 20, -2.0 ** 21, **last)
    yield "GM4", "mu of u8 above 2^20", scale(1, "<2f", 2.0 ** 20, 1.0)
    yield "GM4", "log2 sigma below -12", number("rgb8_f32", 6, -12, -13)
    yield "GM4", "log2 sigma above 30", number("rgb8_f32", 11, 30, 31, **last)
    yield "GM4", "p above 2^10", number("rgb8_f32", 12, 2.0 ** 10, 2.0 ** 11)
    yield "GM4", "p below -2^10", number("rgb8_f32", 12, -2.0 ** 10, -2.0 ** 11, **last)
    yield "GM4", "h_v above 2^20", scale(16, "<2f", 2.0 ** 21, 0.0)
    yield "GM4", "h_l below -2^20", scale(17, "<2f", -2.0 ** 21, 0.0)
    # Layout paper: mu, outputs, sigma of the inputs, of the colours, weight.
    s = model["paper"].s
    inputs, colours, weight = 6 + s, 12 + s, 12 + 2 * s
    yield "GM4", "layout paper: mu above 2^20", number("paper", 2, 2.0 ** 20, 2.0 ** 21)
    yield "GM4", "layout paper: sigma 0", mixture("paper", inputs, "<f", 0.0)
    yield "GM4", "layout paper: sigma below 2^-12", number("paper", inputs + 1, 2.0 ** -12, 0)
    yield "GM4", "layout paper: sigma above 2^30", number("paper", inputs + 5, 2.0 ** 30, 2.0 ** 31)
    yield "GM4", "layout paper: sigma of a colour below 0", mixture("paper", colours, "<f", -1e-30)
    yield "GM4", "layout paper: weight above 1", number("paper", weight, 1, 2)
    yield "GM4", "layout paper: weight below 0", mixture("paper", weight, "<f", -1e-30)
    count = model["paper"].M
    yield "GM4", "layout paper: all weights 0", with_chunk(chunks["paper"], b"GMIX", put(
        4 * weight * count, f"<{count}f", *[0.0] * count))
