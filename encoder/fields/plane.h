// One channel or factor of a texture, in double.
#pragma once
#include <cstdint>
#include <vector>

namespace btfc {

struct FieldPlane {
  std::uint32_t width = 0, height = 0;
  std::vector<double> values;  // rows from the top
  double at(std::uint32_t x, std::uint32_t y) const { return values[std::size_t{y} * width + x]; }
};

double mean_of(const FieldPlane& plane);

}  // namespace btfc
