// Matching values: the numbers in which patches are compared, for all maps of a material together.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/image.h"

namespace btfc {

// Codes -> matching values, one table a map. Integers, so that distances are exact and the choice of a patch
// does not depend on the order of a sum. No two values differ by more than kMaxMatchDifference.
//
//   unorm8    the code, times 16 where another map has more bits
//   unorm16   the code / 16
//   float16   +-2047 at most: 512 sqrt(|v| / mean |v|), since a distance of linear values would see
//   highlights only
//
// Every channel of every map counts alike.
inline constexpr int kMaxMatchDifference = 4095;

class MatchTables {
 public:
  explicit MatchTables(std::span<const Image> maps);
  std::int16_t operator()(std::size_t map, std::uint16_t code) const { return tables_[map][code]; }
  std::uint32_t channels() const { return channels_; }

 private:
  std::vector<std::vector<std::int16_t>> tables_;
  std::uint32_t channels_ = 0;
};

// The sample in matching values: rows from the top, all channels of all maps interleaved.
struct MatchImage {
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::int16_t> values;
  const std::int16_t* row(std::uint32_t x, std::uint32_t y) const {
    return values.data() + (std::size_t{y} * width + x) * channels;
  }
};

MatchImage match_image(const MatchTables& tables, std::span<const Image> maps);

}  // namespace btfc
