// Text -> PARM of a random-field model.
#include "format/models/field_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "format/limits.h"

namespace btfc {

Result<std::optional<std::uint32_t>> parse_automatic(const OptionValues& options, const char* name,
                                                     std::uint32_t least, std::uint32_t most) {
  const auto text = find_option(options, name);
  if (text && *text == "auto") return std::optional<std::uint32_t>();
  return parse_u32(options, name, least, most);
}

Result<FieldShape> field_shape_from_options(const OptionValues& options, const Head& head,
                                            std::uint32_t clusters, std::uint32_t order) {
  FieldShape s;
  s.kind = field_kind(head.model);
  s.factors = head.channels();
  const auto wanted = parse_automatic(options, "clusters", 1, kFieldMostClusters);
  if (!wanted) return wanted.error();
  s.clusters = std::min(wanted->value_or(clusters), head.pairs);
  const auto levels = parse_u32(options, "levels", 1, kFieldMostLevels);
  if (!levels) return levels.error();
  // A level of one texel says nothing.
  const std::uint32_t side = std::max(head.width, head.height);
  s.levels =
      std::min(levels->value_or(4), std::max(1u, static_cast<std::uint32_t>(std::bit_width(side)) - 1));
  if (*levels) s.levels = **levels;
  const auto precision = parse_precision(options, "precision", Precision::f16);
  if (!precision) return precision.error();
  if (*precision == Precision::u8) return bad_argument("--precision is 'u8', expected f32 or f16");
  s.precision = *precision;
  const auto knots = parse_u32(options, "knots", 0, kFieldMostKnots);
  if (!knots) return knots.error();
  s.knots = knots->value_or(16);
  if (s.knots == 1) return bad_argument("--knots is 1, expected 0 or 2 to 64");
  const auto range = parse_pair(options, "range", 0, kMaxSide, true);
  if (!range) return range.error();
  constexpr const char* kBits[] = {"8", "16"};
  const auto bits = parse_choice(options, "range-bits", kBits);
  if (!bits) return bits.error();
  const bool directions = head.pairs > 1;
  const auto size = range->value_or(directions ? std::pair(64u, 64u) : std::pair(0u, 0u));
  if ((size.first == 0) != (size.second == 0))
    return bad_argument("--range has one side of 0, expected WxH or 0");
  if (size.first > 0) {
    s.range_width = std::min(size.first, head.width);
    s.range_height = std::min(size.second, head.height);
    s.range_bits = bits->value_or(0) == 0 ? 8 : 16;
  }
  const auto torus = parse_u32(options, "torus", 1, 1u << kFieldMostTorusLog2);
  if (!torus) return torus.error();
  if (*torus && (s.kind != FieldKind::gmrf || !std::has_single_bit(**torus)))
    return bad_argument("--torus: expected a power of two, and model gmrf");
  if (s.kind == FieldKind::gmrf) {
    const std::uint32_t automatic =
        std::max(std::clamp(std::bit_ceil(2 * side), 64u, 512u), 1u << (s.levels - 1));
    s.torus_log2 = static_cast<std::uint32_t>(std::bit_width(torus->value_or(automatic))) - 1;
    if (s.torus_log2 + 1 < s.levels)
      return bad_argument(fmt::format("--torus: {} levels need at least {}", s.levels, 1u << (s.levels - 1)));
  } else {
    std::fill_n(s.margins.begin(), s.levels, 32u);
  }
  const auto neighbours = parse_automatic(options, "order", 0, kFieldCandidates);
  if (!neighbours) return neighbours.error();
  s.masks.assign(std::size_t{s.levels} * s.masks_per_level(),
                 nearest_candidates(neighbours->value_or(order)));
  return s;
}

}  // namespace btfc
