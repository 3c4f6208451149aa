// A mixture under one pair of directions and one footprint: what texels of an image are reckoned from.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "format/models/gm_field.h"

namespace btfc {

// Rows of what is left of a component once the directions are given.
inline constexpr std::size_t kGmBase = 0;   // height less the angular distance
inline constexpr std::size_t kGmPlace = 1;  // x, y: mu with the drift
inline constexpr std::size_t kGmWidth = 3;  // scales of x, y
inline constexpr std::size_t kGmValue = 5;  // outputs, four
inline constexpr std::size_t kGmPairRows = 9;

// rows[row * stride + m]; padded to kGmPad components with a base of GM_NEVER. Does not own its rows.
struct GmSlice {
  std::uint32_t count = 0, stride = 0, channels = 3;
  float width = 1, height = 1;  // texels
  bool wraps = false;
  const float* rows = nullptr;
  const float* row(std::size_t r) const { return rows + r * stride; }
};

// Without the components that together weigh less than `error` of the whole at every place of the tile. They
// are filled into `rows`. variance: that of the footprint, texels^2; far_limit: gm_far_limit's, where the
// variance is not 0.
GmSlice gm_slice(const GmField& field, const GmPairInputs& directions, float variance, const vec4& far_limit,
                 float error, std::vector<float>& rows);

// Of gates between low[m] and high[m], powers of two: how high a gate must reach to be looked at, so that
// those that do not weigh less than `error` of the whole.
float gm_cut(const float* low, const float* high, std::size_t count, float error);

}  // namespace btfc
