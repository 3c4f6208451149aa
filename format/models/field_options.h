// Options of the random-field models that sizes follow from, shared by `btfc size` and the fits.
#pragma once
#include "format/models/field_shape.h"

namespace btfc {

inline constexpr OptionSpec kFieldOptions[] = {
    {"clusters", "C|auto", "subspaces of the directions (default auto: 95 % of the variance; size: 10)"},
    {"levels", "P", "levels of the pyramid, 1 to 8 (default 4)"},
    {"order", "N|auto", "neighbours of a texel, 0 to 40 (default auto: by evidence; size: 12)"},
    {"range", "WxH", "texels of the range map, 0: none (default 64x64 of a BTF)"},
    {"range-bits", "8|16", "bits a height of the range map (default 8)"},
    {"precision", "f32|f16", "of all other numbers (default f16)"},
    {"knots", "K", "knots of a factor's marginal table, 2 to 64, or 0: none (default 16)"},
    {"torus", "N", "gmrf: side of the torus, a power of two (default: at least twice the tile, 64 to 512)"},
};

// What the options say of PARM; `order` and `clusters` are those that "auto" stands for.
Result<FieldShape> field_shape_from_options(const OptionValues& options, const Head& head,
                                            std::uint32_t clusters, std::uint32_t order);
// Nothing: "auto", or absent.
Result<std::optional<std::uint32_t>> parse_automatic(const OptionValues& options, const char* name,
                                                     std::uint32_t least, std::uint32_t most);

}  // namespace btfc
