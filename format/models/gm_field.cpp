// Mixture -> arrays.
#include "format/models/gm_field.h"

#include <bit>

namespace btfc {

GmField gm_field(const GmMixture& mixture, std::uint32_t width, std::uint32_t height, bool wraps) {
  GmField field;
  const GmShape& shape = mixture.shape;
  field.components = shape.components;
  field.stride = (shape.components + kGmPad - 1) / kGmPad * kGmPad;
  field.channels = shape.channels;
  field.width = static_cast<float>(width);
  field.height = static_cast<float>(height);
  field.wraps = wraps;
  field.data.assign(std::size_t{kGmFieldRows} * field.stride, 0.0f);
  for (std::uint32_t m = 0; m < field.stride; ++m) field.row(GM_HEIGHT)[m] = GM_NEVER;
  for (std::uint32_t m = 0; m < shape.components; ++m) {
    for (std::uint32_t n = 0; n < kGmInputs; ++n) {
      field.row(n)[m] = mixture.row(kGmMeanRow + n)[m];
      // log2(e) / (2 sigma^2)
      field.row(GM_SCALE + n)[m] = 0.72134752f * btfc_exp2(-2.0f * mixture.row(kGmSpreadRow + n)[m]);
    }
    field.row(GM_HEIGHT)[m] = mixture.row(kGmHeightRow)[m];
    for (std::uint32_t c = 0; c < shape.channels; ++c) {
      field.row(GM_OUTPUT + c)[m] = mixture.row(kGmOutputRow + c)[m];
    }
    for (std::uint32_t h = 0; h < 2 && shape.shear; ++h) {
      field.row(GM_SHEAR + h)[m] = mixture.row(shape.shear_row() + h)[m];
    }
  }
  return field;
}

std::vector<std::uint32_t> gm_component_words(const GmField& field) {
  std::vector<std::uint32_t> words(std::size_t{field.components} * GM_STRIDE);
  for (std::uint32_t m = 0; m < field.components; ++m) {
    for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
      words[std::size_t{m} * GM_STRIDE + r] = std::bit_cast<std::uint32_t>(field.row(r)[m]);
    }
  }
  return words;
}

GmField gm_field_of_words(const std::vector<std::uint32_t>& words, const GmParams& params) {
  GmField field;
  field.components = params.components;
  field.stride = (params.components + kGmPad - 1) / kGmPad * kGmPad;
  field.channels = params.channels;
  field.width = static_cast<float>(params.width);
  field.height = static_cast<float>(params.height);
  field.wraps = params.wrap_u == 1;
  field.data.assign(std::size_t{kGmFieldRows} * field.stride, 0.0f);
  for (std::uint32_t m = field.components; m < field.stride; ++m) field.row(GM_HEIGHT)[m] = GM_NEVER;
  // The map's outputs come first.
  const auto skipped = [&](std::uint32_t r) {
    return r >= GM_OUTPUT && r < GM_OUTPUT + params.channels ? params.first_channel : 0;
  };
  for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
    for (std::uint32_t m = 0; m < field.components; ++m)
      field.row(r)[m] = std::bit_cast<float>(words[std::size_t{m} * GM_STRIDE + r + skipped(r)]);
  }
  return field;
}

GmPairInputs gm_pair_inputs(const GmDirections& d) {
  return {{d.view.x, d.view.y, d.light.x, d.light.y},
          {d.view_slope.x, d.view_slope.y, d.light_slope.x, d.light_slope.y}};
}

void gm_set_directions(const GmPairInputs& low, const GmPairInputs& high, GmBox& box) {
  for (std::size_t n = 0; n < 4; ++n) {
    box.middle.angle[n] = 0.5f * (low.angle[n] + high.angle[n]);
    box.half.angle[n] = 0.5f * (high.angle[n] - low.angle[n]);
    box.middle.slope[n] = 0.5f * (low.slope[n] + high.slope[n]);
    box.half.slope[n] = 0.5f * (high.slope[n] - low.slope[n]);
  }
}

}  // namespace btfc
