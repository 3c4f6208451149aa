// How much of the bump filter images bear, and images without it.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "encoder/fields/plane.h"

namespace btfc {

// Of the strengths 0, 0.05 … 1 (spec/models/car.md section 5.7) the one whose filter, taken off the images,
// leaves the least of their variance over their squared means; images are then divided by it. heights: of the
// range map, in texels; lights: unit vectors, one an image.
float take_relief_off(std::span<const float> heights, std::uint32_t range_width, std::uint32_t range_height,
                      std::span<const std::array<float, 3>> lights,
                      std::vector<std::vector<FieldPlane>>& images);

}  // namespace btfc
