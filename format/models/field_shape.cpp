// PARM of the random-field models, its rules and formulas.
#include "format/models/field_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "format/directions.h"
#include "format/limits.h"
#include "format/table_model.h"
#include "shaders/models/field.h"

namespace btfc {
namespace {

constexpr std::uint64_t kAllCandidates = (std::uint64_t{1} << kFieldCandidates) - 1;

std::uint64_t padded_bits(std::uint64_t bits) { return 32 * ceil_div(bits, 32); }

std::uint64_t range_bytes(const FieldShape& s) {
  return 8 + 4 * ceil_div(std::uint64_t{s.range_width} * s.range_height * s.range_bits, 32);
}

std::uint64_t index_words(const Head& head, const FieldShape& s) {
  return ceil_div(std::uint64_t{head.pairs} * s.index_bits(), 32);
}

}  // namespace

std::uint32_t FieldShape::factor_begin(std::uint32_t level, std::uint32_t factor) const {
  if (coupled()) return 0;
  std::uint32_t begin = 0;
  for (std::uint32_t f = 0; f < factor; ++f) begin += 1 + neighbours(level, f);
  return begin;
}

std::uint32_t FieldShape::level_numbers(std::uint32_t level) const {
  if (!coupled()) return factor_begin(level, factors);
  return factors * (factors + 1) / 2 + neighbours(level, 0) * factors * factors;
}

Bytes write_field_parm(const FieldShape& s) {
  Bytes raw(s.parm_bytes());
  store_u32(&raw[0], s.clusters);
  raw[4] = static_cast<std::uint8_t>(s.levels);
  raw[5] = static_cast<std::uint8_t>(s.precision);
  raw[6] = static_cast<std::uint8_t>(s.range_bits);
  raw[7] = static_cast<std::uint8_t>(s.knots);
  store_u16(&raw[8], static_cast<std::uint16_t>(s.range_width));
  store_u16(&raw[10], static_cast<std::uint16_t>(s.range_height));
  store_u32(&raw[12], s.seed);
  store_f32(&raw[16], s.error);
  raw[20] = static_cast<std::uint8_t>(s.torus_log2);
  for (std::size_t l = 0; l < kFieldMostLevels; ++l)
    store_u16(&raw[24 + 2 * l], static_cast<std::uint16_t>(s.margins[l]));
  for (std::size_t i = 0; i < s.masks.size(); ++i) store_u64(&raw[40 + 8 * i], s.masks[i]);
  return raw;
}

Result<FieldShape> read_field_parm(const Head& head, ByteView raw) {
  const auto wrong = [](const char* what, std::uint64_t value, const std::string& expected) {
    return invalid("FD1", 0, fmt::format("PARM has {} {}, expected {}", what, value, expected));
  };
  if (raw.size() < 40)
    return invalid("FD1", 0, fmt::format("PARM has {} bytes, expected 48 or more", raw.size()));
  FieldShape s;
  s.kind = field_kind(head.model);
  s.factors = head.channels();
  s.clusters = load_u32(&raw[0]);
  const std::uint32_t most = std::min(head.pairs, kFieldMostClusters);
  if (s.clusters < 1 || s.clusters > most) return wrong("clusters", s.clusters, fmt::format("1 to {}", most));
  s.levels = raw[4];
  if (s.levels < 1 || s.levels > kFieldMostLevels) return wrong("levels", s.levels, "1 to 8");
  if (raw[5] > 1) return wrong("precision", raw[5], "0 or 1");
  s.precision = static_cast<Precision>(raw[5]);
  s.range_bits = raw[6];
  if (s.range_bits != 0 && s.range_bits != 8 && s.range_bits != 16)
    return wrong("range_bits", s.range_bits, "0, 8 or 16");
  s.knots = raw[7];
  if (s.knots == 1 || s.knots > kFieldMostKnots) return wrong("knots", s.knots, "0 or 2 to 64");
  s.range_width = load_u16(&raw[8]);
  s.range_height = load_u16(&raw[10]);
  const bool range = s.range_bits != 0;
  if ((s.range_width != 0) != range || (s.range_height != 0) != range || s.range_width > head.width ||
      s.range_height > head.height) {
    return invalid(
        "FD1", 0,
        fmt::format("PARM has a range map of {}x{} with {} bits, expected at most the tile's {}x{}, "
                    "and 0x0 with 0 bits",
                    s.range_width, s.range_height, s.range_bits, head.width, head.height));
  }
  s.seed = load_u32(&raw[12]);
  s.error = load_f32(&raw[16]);
  if (!(s.error >= 0 && s.error <= 4294967296.0f)) {
    return invalid("FD1", 0, fmt::format("PARM has an error of {:g}, expected 0 to 2^32", s.error));
  }
  s.torus_log2 = raw[20];
  const bool torus = s.kind == FieldKind::gmrf;
  if (torus ? s.torus_log2 + 1 < s.levels || s.torus_log2 > kFieldMostTorusLog2 : s.torus_log2 != 0)
    return wrong("torus_log2", s.torus_log2, torus ? "levels - 1 to 11" : "0");
  for (std::size_t i = 21; i < 24; ++i) {
    if (raw[i] != 0) return wrong("reserved", raw[i], "0");
  }
  for (std::uint32_t l = 0; l < kFieldMostLevels; ++l) {
    s.margins[l] = load_u16(&raw[24 + 2 * std::size_t{l}]);
    const bool margin = l < s.levels && !torus;
    if (margin ? s.margins[l] < 4 || s.margins[l] > kFieldMostMargin : s.margins[l] != 0)
      return wrong("margin", s.margins[l], margin ? "4 to 255" : "0");
  }
  s.masks.resize(std::size_t{s.levels} * s.masks_per_level());
  if (raw.size() != s.parm_bytes()) {
    return invalid("FD1", 0, fmt::format("PARM has {} bytes, expected {}", raw.size(), s.parm_bytes()));
  }
  for (std::size_t i = 0; i < s.masks.size(); ++i) {
    s.masks[i] = load_u64(&raw[40 + 8 * i]);
    if ((s.masks[i] & ~kAllCandidates) != 0) return wrong("neighbourhood", s.masks[i], "below 2^40");
  }
  if (const auto counts = check_direction_counts(head); !counts) return counts.error();
  if (!head.unbounded || head.value_transform != ValueTransform::identity)
    return invalid("FD2", 0, "HEAD is not unbounded, or has a value transform");
  for (const ChunkSpec& chunk : field_chunks(head, s)) {
    if (chunk.raw_bytes > kMaxChunkBytes)
      return invalid("FD2", 0,
                     fmt::format("{} takes {} bytes, expected at most 2^27", type_name(chunk.key.type),
                                 chunk.raw_bytes));
  }
  std::uint64_t responses = 0;
  for (std::uint32_t l = 0; l < s.levels; ++l) responses += s.responses() * s.response_words(l);
  if (responses > kMaxChunkBytes / 4 || field_memory_words(head, s) - responses > kMaxChunkBytes / 4) {
    return invalid("FD2", 0,
                   fmt::format("impulse responses of {} subspaces take {} words, expected at most {}",
                               s.clusters, responses, kMaxChunkBytes / 4));
  }
  return s;
}

std::vector<ChunkSpec> field_chunks(const Head& head, const FieldShape& s) {
  const auto rows = [&](std::uint32_t columns) {
    return coded_rows_bytes(s.clusters, columns, s.precision).saturated();
  };
  std::vector<ChunkSpec> chunks = {directions_chunk(head),
                                   {{kParm, kPayloadChunk}, s.parm_bytes()},
                                   {{kSubs, kPayloadChunk}, rows(s.record_numbers())}};
  if (s.index_bits() > 0) chunks.push_back({{kSidx, kPayloadChunk}, 4 * index_words(head, s)});
  if (s.range_bits > 0) chunks.push_back({{kRmap, kPayloadChunk}, range_bytes(s)});
  for (std::uint32_t l = 0; l < s.levels; ++l)
    chunks.push_back({{kFlds, kPayloadChunk, field_chunk_level(s, l)}, rows(s.level_numbers(l))});
  return chunks;
}

std::uint64_t field_formula_bits(const Head& head, const FieldShape& s) {
  const std::uint64_t number = s.precision == Precision::f32 ? 32 : 16, c = s.clusters, d = s.factors;
  std::uint64_t bits = 320 + 64 * std::uint64_t{s.levels} * s.masks_per_level();
  bits += padded_bits(std::uint64_t{head.pairs} * s.index_bits());
  if (s.range_bits > 0)
    bits += 64 + padded_bits(std::uint64_t{s.range_bits} * s.range_width * s.range_height);
  bits += padded_bits(number * c * (d + (s.coupled() ? 0 : d * d) + 4 + d * (s.levels + s.knots)));
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    std::uint64_t numbers = s.coupled() ? d * (d + 1) / 2 + d * d * s.neighbours(l, 0) : d;
    for (std::uint32_t f = 0; f < d && !s.coupled(); ++f) numbers += s.neighbours(l, f);
    bits += padded_bits(number * c * numbers);
  }
  return bits;
}

std::uint64_t field_memory_words(const Head& head, const FieldShape& s) {
  std::uint64_t words =
      direction_words(head) + std::uint64_t{FIELD_LEVEL_WORDS} * s.levels + index_words(head, s);
  if (s.range_bits > 0) words += 1 + std::uint64_t{s.range_width} * s.range_height;
  words += std::uint64_t{s.clusters} * s.record_numbers();
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    words += 2 * s.masks_per_level() + std::uint64_t{s.clusters} * s.level_numbers(l) +
             s.responses() * s.response_words(l);
  }
  return words;
}

std::uint64_t nearest_candidates(std::uint32_t n) {
  std::array<std::uint32_t, kFieldCandidates> order{};
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [](std::uint32_t a, std::uint32_t b) {
    const auto distance = [](FieldOffset o) { return o.dx * o.dx + o.dy * o.dy; };
    return distance(field_offset(a)) < distance(field_offset(b));
  });
  std::uint64_t mask = 0;
  for (std::uint32_t i = 0; i < n && i < kFieldCandidates; ++i) mask |= std::uint64_t{1} << order[i];
  return mask;
}

}  // namespace btfc
