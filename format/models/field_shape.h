// Models car, gmrf and car3d: PARM, what it asks of HEAD, and the size formulas (spec/models/car.md).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kFieldMostLevels = 8;
inline constexpr std::uint32_t kFieldMostMargin = 255;
inline constexpr std::uint32_t kFieldMostKnots = 64;
inline constexpr std::uint32_t kFieldMostClusters = 32768;
inline constexpr std::uint32_t kFieldMostTorusLog2 = 11;
inline constexpr std::uint32_t kFieldCandidates = 40;

enum class FieldKind : std::uint32_t { car = 0, gmrf = 1, car3d = 2 };

constexpr FieldKind field_kind(ModelId model) {
  return model == ModelId::gmrf    ? FieldKind::gmrf
         : model == ModelId::car3d ? FieldKind::car3d
                                   : FieldKind::car;
}

// A neighbour's place: the texel at (x + dx, y + dy). Candidate i of a neighbourhood, 0 … 39, in raster
// order: four rows above, from dx = -4 to 4, then the four texels to the left, the nearest last.
struct FieldOffset {
  int dx = 0, dy = 0;
};
constexpr FieldOffset field_offset(std::uint32_t candidate) {
  const int i = static_cast<int>(candidate);
  return i < 36 ? FieldOffset{i % 9 - 4, i / 9 - 4} : FieldOffset{i - 40, 0};
}

// PARM.
struct FieldShape {
  FieldKind kind = FieldKind::car;
  std::uint32_t factors = 3;   // d: HEAD's channels
  std::uint32_t clusters = 1;  // c
  std::uint32_t levels = 1;    // P; level 0 is the finest
  Precision precision = Precision::f16;
  std::uint32_t range_bits = 0;  // 0: no range map, 8 or 16
  std::uint32_t range_width = 0, range_height = 0;
  std::uint32_t knots = 0;  // of marginal tables; 0: none
  std::uint32_t seed = 1;
  float error = 0;               // of values, by tiles
  std::uint32_t torus_log2 = 0;  // gmrf: the finest level's torus
  std::array<std::uint32_t, kFieldMostLevels> margins{};
  std::vector<std::uint64_t> masks;  // of (level, factor), bit i: candidate i; of car3d one a level
  bool operator==(const FieldShape&) const = default;

  bool coupled() const { return kind == FieldKind::car3d; }
  std::uint32_t masks_per_level() const { return coupled() ? 1 : factors; }
  std::uint64_t mask(std::uint32_t level, std::uint32_t factor) const {
    return masks[std::size_t{level} * masks_per_level() + (coupled() ? 0 : factor)];
  }
  std::uint32_t neighbours(std::uint32_t level, std::uint32_t factor) const {
    return static_cast<std::uint32_t>(__builtin_popcountll(mask(level, factor)));
  }
  // Numbers of a subspace's record, and of its record of a level.
  std::uint32_t record_numbers() const {
    return factors + (coupled() ? 0 : factors * factors) + 4 + factors * (levels + knots);
  }
  std::uint32_t level_numbers(std::uint32_t level) const;
  // Where a factor's numbers begin in a level's record: its spread, then a coefficient a neighbour. Of car3d
  // the noise's factor comes first, d (d + 1) / 2 numbers, then d x d a neighbour.
  std::uint32_t factor_begin(std::uint32_t level, std::uint32_t factor) const;
  std::uint32_t index_bits() const { return ceil_log2(clusters); }
  std::uint32_t torus_side(std::uint32_t level) const { return 1u << (torus_log2 - level); }
  // Words of slot 1 that one response of a level takes, or one torus.
  std::uint64_t response_words(std::uint32_t level) const {
    if (kind == FieldKind::gmrf) return std::uint64_t{torus_side(level)} * torus_side(level);
    return (std::uint64_t{margins[level]} + 1) * (2 * std::uint64_t{margins[level]} + 1);
  }
  std::uint64_t responses() const { return std::uint64_t{clusters} * factors * (coupled() ? factors : 1); }
  std::uint64_t parm_bytes() const { return 40 + 8 * std::uint64_t{levels} * masks_per_level(); }
};

Bytes write_field_parm(const FieldShape& shape);
// Rules FD1 and FD2, and V1.
Result<FieldShape> read_field_parm(const Head& head, ByteView raw);

// The closed formulas.
std::uint64_t field_formula_bits(const Head& head, const FieldShape& shape);
std::uint64_t field_memory_words(const Head& head, const FieldShape& shape);

std::vector<ChunkSpec> field_chunks(const Head& head, const FieldShape& shape);

// The n candidates nearest to the texel, ties in raster order.
std::uint64_t nearest_candidates(std::uint32_t n);

inline constexpr std::uint32_t kFieldChunkTypes[] = {kDirs, four_cc("FLDS"), four_cc("RMAP"), four_cc("SIDX"),
                                                     four_cc("SUBS")};
inline constexpr std::uint32_t kFlds = kFieldChunkTypes[1], kRmap = kFieldChunkTypes[2],
                               kSidx = kFieldChunkTypes[3], kSubs = kFieldChunkTypes[4];

// Which chunk level holds a level of the pyramid: the coarsest comes first.
inline std::uint8_t field_chunk_level(const FieldShape& shape, std::uint32_t level) {
  return static_cast<std::uint8_t>(shape.levels - 1 - level);
}

}  // namespace btfc
