// Reduce, expand, subtract.
#include "encoder/fields/laplacian_pyramid.h"

#include <array>

namespace btfc {
namespace {

std::uint32_t fold(std::int64_t at, std::uint32_t size, bool wraps) {
  const auto n = static_cast<std::int64_t>(size);
  if (n == 1) return 0;
  if (wraps) return static_cast<std::uint32_t>((at % n + n) % n);
  const std::int64_t period = 2 * (n - 1);  // the border texel once
  at = (at % period + period) % period;
  return static_cast<std::uint32_t>(at < n ? at : period - at);
}

// Every second texel of the smoothed rows, rows and columns exchanged.
FieldPlane halved_and_turned(const FieldPlane& fine, bool wraps) {
  constexpr std::array<double, 5> kKernel = {1.0 / 16, 4.0 / 16, 6.0 / 16, 4.0 / 16, 1.0 / 16};
  FieldPlane out{fine.height, (fine.width + 1) / 2, {}};
  out.values.reserve(std::size_t{out.width} * out.height);
  for (std::uint32_t x = 0; x < out.height; ++x) {
    for (std::uint32_t y = 0; y < fine.height; ++y) {
      double sum = 0;
      for (int i = -2; i <= 2; ++i) {
        sum += kKernel[static_cast<std::size_t>(i + 2)] *
               fine.at(fold(std::int64_t{2} * x + i, fine.width, wraps), y);
      }
      out.values.push_back(sum);
    }
  }
  return out;
}

FieldPlane reduce(const FieldPlane& fine, bool wraps) {
  return halved_and_turned(halved_and_turned(fine, wraps), wraps);
}

// What expanding gives at one place of an axis: three coarse places and their weights.
struct Taps {
  std::array<std::uint32_t, 3> at;
  std::array<double, 3> weight;
};
Taps taps(std::uint32_t fine, std::uint32_t coarse_size, bool wraps) {
  const std::int64_t i = fine / 2;
  const std::array<std::uint32_t, 3> at = {fold(i - 1, coarse_size, wraps), fold(i, coarse_size, wraps),
                                           fold(i + 1, coarse_size, wraps)};
  if (fine % 2 == 1) return {at, {0, 0.5, 0.5}};
  return {at, {0.125, 0.75, 0.125}};
}

void subtract_expanded(const FieldPlane& coarse, bool wraps, FieldPlane& fine) {
  for (std::uint32_t y = 0; y < fine.height; ++y) {
    const Taps v = taps(y, coarse.height, wraps);
    for (std::uint32_t x = 0; x < fine.width; ++x) {
      const Taps u = taps(x, coarse.width, wraps);
      double sum = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t i = 0; i < 3; ++i) sum += v.weight[j] * u.weight[i] * coarse.at(u.at[i], v.at[j]);
      }
      fine.values[std::size_t{y} * fine.width + x] -= sum;
    }
  }
}

}  // namespace

std::vector<FieldPlane> gaussian_pyramid(const FieldPlane& plane, std::uint32_t levels, bool wraps) {
  std::vector<FieldPlane> out = {plane};
  while (out.size() < levels) out.push_back(reduce(out.back(), wraps));
  return out;
}

std::vector<FieldPlane> laplacian_pyramid(const FieldPlane& plane, std::uint32_t levels, bool wraps) {
  std::vector<FieldPlane> out = gaussian_pyramid(plane, levels, wraps);
  for (std::uint32_t l = 0; l + 1 < levels; ++l) subtract_expanded(out[l + 1], wraps, out[l]);
  return out;
}

}  // namespace btfc
