// Tables from codes to matching values.
#include "encoder/models/patch_features.h"

#include <algorithm>
#include <cmath>

namespace btfc {
namespace {

std::vector<std::int16_t> half_table(const Image& image) {
  double sum = 0;
  for (const std::uint16_t code : image.codes) sum += std::fabs(code_value(SampleType::float16, code));
  const double mean = image.codes.empty() ? 0 : sum / static_cast<double>(image.codes.size());
  std::vector<std::int16_t> table(65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    const double v = code_value(SampleType::float16, static_cast<std::uint16_t>(code));
    if (!std::isfinite(v) || mean == 0) continue;  // refused before, or a black sample
    const double root = std::min(512 * std::sqrt(std::fabs(v) / mean), 2047.0);
    table[code] = static_cast<std::int16_t>(std::lrint(v < 0 ? -root : root));
  }
  return table;
}

std::vector<std::int16_t> unorm_table(SampleType type, bool mixed) {
  std::vector<std::int16_t> table(65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    const std::size_t value = type == SampleType::unorm16 ? code / 16
                              : mixed                     ? (code & 0xff) * 16
                                                          : code & 0xff;
    table[code] = static_cast<std::int16_t>(value);
  }
  return table;
}

}  // namespace

MatchTables::MatchTables(std::span<const Image> maps) {
  const bool mixed =
      std::any_of(maps.begin(), maps.end(), [](const Image& m) { return m.type != SampleType::unorm8; });
  for (const Image& map : maps) {
    tables_.push_back(map.type == SampleType::float16 ? half_table(map) : unorm_table(map.type, mixed));
    channels_ += map.channels;
  }
}

MatchImage match_image(const MatchTables& tables, std::span<const Image> maps) {
  MatchImage out{maps[0].width, maps[0].height, tables.channels(), {}};
  out.values.reserve(std::size_t{out.width} * out.height * out.channels);
  for (std::size_t q = 0; q < std::size_t{out.width} * out.height; ++q) {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      for (std::size_t c = 0; c < maps[m].channels; ++c) {
        out.values.push_back(tables(m, maps[m].codes[q * maps[m].channels + c]));
      }
    }
  }
  return out;
}

}  // namespace btfc
