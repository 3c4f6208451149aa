// Sixteen sums at a time stay in registers while the taps go by.
#include "encoder/metrics/row_filter.h"

#include <algorithm>
#include <array>

namespace btfc {
namespace {

constexpr std::size_t kLanes = 16;

template <class RowOf>
void weigh(std::span<const float> taps, const RowOf& row_of, std::span<float> out) {
  std::size_t i = 0;
  for (; i + kLanes <= out.size(); i += kLanes) {
    std::array<float, kLanes> sums{};
    for (std::size_t t = 0; t < taps.size(); ++t) {
      const float tap = taps[t];
      const float* row = row_of(t) + i;
      for (std::size_t l = 0; l < kLanes; ++l) sums[l] += tap * row[l];
    }
    std::copy_n(sums.data(), kLanes, out.data() + i);
  }
  for (; i < out.size(); ++i) {
    float sum = 0;
    for (std::size_t t = 0; t < taps.size(); ++t) sum += taps[t] * row_of(t)[i];
    out[i] = sum;
  }
}

}  // namespace

void weigh_rows(std::span<const float> taps, std::span<const float* const> rows, std::span<float> out) {
  weigh(
      taps, [&](std::size_t t) { return rows[t]; }, out);
}

void filter_along(std::span<const float> taps, const float* first, std::span<float> out) {
  weigh(
      taps, [&](std::size_t t) { return first + t; }, out);
}

}  // namespace btfc
