// A mixture laid out for fast evaluation: one array a number, padded to whole vectors, with the precisions of
// shaders/models/gm.h; and the boxes of inputs over which components are culled.
#pragma once
#include <cstdint>
#include <vector>

#include "format/models/gm_mixture.h"
#include "shaders/models/gm.h"

namespace btfc {

inline constexpr std::uint32_t kGmPad = 16;        // components come in multiples of this
inline constexpr std::uint32_t kGmFieldRows = 19;  // as the floats of GM_COMPONENTS, without the free one

// data[row * stride + m]; components beyond the mixture's have a height of GM_NEVER.
struct GmField {
  std::uint32_t components = 0, stride = 0, channels = 3;
  float width = 1, height = 1;  // texels
  bool wraps = false;
  std::vector<float> data;
  const float* row(std::uint32_t r) const { return data.data() + std::size_t{r} * stride; }
  float* row(std::uint32_t r) { return data.data() + std::size_t{r} * stride; }
};

GmField gm_field(const GmMixture& mixture, std::uint32_t width, std::uint32_t height, bool wraps);

// The words of slot GM_COMPONENTS, and back with the outputs of a map.
std::vector<std::uint32_t> gm_component_words(const GmField& field);
GmField gm_field_of_words(const std::vector<std::uint32_t>& words, const GmParams& params);

// A pair of directions: view a, b, light a, b; then the slopes view x, y, light x, y.
struct GmPairInputs {
  float angle[4] = {}, slope[4] = {};
};
GmPairInputs gm_pair_inputs(const GmDirections& directions);

// A box of inputs: middles and half widths of x, y, the angles and the slopes.
struct GmBox {
  float x = 0, y = 0, half_x = 0, half_y = 0;
  GmPairInputs middle, half;
};

// Of all inputs between `low` and `high`; x and y are left as they are.
void gm_set_directions(const GmPairInputs& low, const GmPairInputs& high, GmBox& box);

}  // namespace btfc
