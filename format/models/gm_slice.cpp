// Field -> slice.
#include "format/models/gm_slice.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace btfc {
namespace {

// Nearest and farthest distance of a place from the tile's span of one axis.
struct Span {
  float near, far;
};
Span span_from(float place, float size, bool wraps) {
  if (wraps) return {0, 0.5f * size};
  return {std::max({0.0f, -place, place - size}), std::max(std::fabs(place), std::fabs(size - place))};
}

}  // namespace

float gm_cut(const float* low, const float* high, std::size_t count, float error) {
  float most = GM_NEVER;
  for (std::size_t m = 0; m < count; ++m) most = std::max(most, low[m]);
  float sure = 0;  // of all together, seen from the most
  for (std::size_t m = 0; m < count; ++m) {
    if (low[m] > most - 20) sure += btfc_exp2(low[m] - most);
  }
  const float whole = most + btfc_log2(sure);
  // How many may be within 2^-b of the whole; from the least on they are left out while there is room.
  constexpr int kBins = 64;
  std::array<std::uint32_t, kBins> bins{};
  for (std::size_t m = 0; m < count; ++m) {
    const float below = whole - high[m];
    ++bins[static_cast<std::size_t>(below <= 0           ? 0
                                    : below >= kBins - 1 ? kBins - 1
                                                         : static_cast<int>(below))];
  }
  float left_out = 0;
  int bin = kBins - 1;
  for (; bin > 0; --bin) {
    left_out += static_cast<float>(bins[static_cast<std::size_t>(bin)]) * btfc_exp2(-static_cast<float>(bin));
    if (left_out > error) break;
  }
  return whole - static_cast<float>(bin + 1);
}

GmSlice gm_slice(const GmField& field, const GmPairInputs& d, float variance, const vec4& far_limit,
                 float error, std::vector<float>& rows) {
  GmSlice slice;
  slice.channels = field.channels;
  slice.width = field.width;
  slice.height = field.height;
  slice.wraps = field.wraps;
  const std::size_t s = field.stride;
  std::vector<float> all(kGmPairRows * s), low(field.components), high(field.components);
  for (std::uint32_t m = 0; m < field.components; ++m) {
    float angular = 0;
    for (std::uint32_t n = 0; n < 4; ++n) {
      const float t = d.angle[n] - field.row(2 + n)[m];
      angular += field.row(GM_SCALE + 2 + n)[m] * t * t;
    }
    float base = field.row(GM_HEIGHT)[m] - angular;
    float scale[2] = {field.row(GM_SCALE)[m], field.row(GM_SCALE + 1)[m]};
    float share = 0;
    if (variance > 0) {
      const GmWider wider = gm_wider(scale[0], scale[1], variance);
      scale[0] = wider.x;
      scale[1] = wider.y;
      base += wider.peak;
      share = 1 - btfc_exp2(wider.peak);
    }
    low[m] = high[m] = base;
    for (std::uint32_t n = 0; n < 2; ++n) {
      const float place =
          field.row(n)[m] + field.row(GM_SHEAR)[m] * d.slope[n] + field.row(GM_SHEAR + 1)[m] * d.slope[2 + n];
      const Span span = span_from(place, n == 0 ? field.width : field.height, field.wraps);
      low[m] -= scale[n] * span.far * span.far;
      high[m] -= scale[n] * span.near * span.near;
      all[(kGmPlace + n) * s + m] = place;
      all[(kGmWidth + n) * s + m] = scale[n];
    }
    all[kGmBase * s + m] = base;
    for (std::uint32_t c = 0; c < field.channels; ++c) {
      all[(kGmValue + c) * s + m] = field.row(GM_OUTPUT + c)[m] - share * far_limit[static_cast<int>(c)];
    }
  }
  const float least = gm_cut(low.data(), high.data(), field.components, error);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t m = 0; m < field.components; ++m) {
    if (high[m] >= least) kept.push_back(m);
  }
  slice.count = static_cast<std::uint32_t>(kept.size());
  slice.stride = (slice.count + kGmPad - 1) / kGmPad * kGmPad;
  rows.assign(kGmPairRows * slice.stride, 0.0f);
  std::fill_n(rows.begin() + kGmBase * slice.stride, slice.stride, GM_NEVER);
  for (std::size_t r = 0; r < kGmPairRows; ++r) {
    for (std::size_t i = 0; i < kept.size(); ++i) rows[r * slice.stride + i] = all[r * s + kept[i]];
  }
  slice.rows = rows.data();
  return slice;
}

}  // namespace btfc
