// Trying strengths.
#include "encoder/fields/relief_strength.h"

#include <bit>
#include <cmath>

#include "shaders/models/field.h"

namespace btfc {
namespace {

constexpr int kSteps = 20;

// The filter at strength 1 for every texel.
std::vector<float> shades(std::span<const float> heights, std::uint32_t range_width,
                          std::uint32_t range_height, const std::array<float, 3>& light, std::uint32_t width,
                          std::uint32_t height) {
  std::vector<std::uint32_t> slot = {0};
  for (const float h : heights) slot.push_back(std::bit_cast<std::uint32_t>(h));
  const BtfcWords words = {{slot.data(), nullptr, nullptr, nullptr}};
  FieldParams p{};
  p.width = width;
  p.height = height;
  p.range_size = range_width | range_height << 16;
  std::vector<float> out;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const vec2 slopes = field_slopes(words, p, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      out.push_back(field_slope_shade(slopes, vec3(light[0], light[1], light[2])));
    }
  }
  return out;
}

double filter(float shade, double strength) { return 1 + strength * (double{shade} - 1); }

}  // namespace

float take_relief_off(std::span<const float> heights, std::uint32_t range_width, std::uint32_t range_height,
                      std::span<const std::array<float, 3>> lights,
                      std::vector<std::vector<FieldPlane>>& images) {
  std::array<double, kSteps + 1> cost{};
  std::vector<std::vector<float>> all;
  for (std::size_t k = 0; k < images.size(); ++k) {
    all.push_back(
        shades(heights, range_width, range_height, lights[k], images[k][0].width, images[k][0].height));
    for (int step = 0; step <= kSteps; ++step) {
      const double strength = static_cast<double>(step) / kSteps;
      for (const FieldPlane& plane : images[k]) {
        double sum = 0, squares = 0;
        bool possible = true;
        for (std::size_t i = 0; i < plane.values.size(); ++i) {
          const double f = filter(all[k][i], strength);
          possible = possible && f >= 0.25;
          const double v = plane.values[i] / std::max(f, 0.25);
          sum += v;
          squares += v * v;
        }
        const double n = static_cast<double>(plane.values.size()), mean = sum / n;
        // A filter that all but blackens texels cannot be taken off.
        cost[static_cast<std::size_t>(step)] +=
            possible ? (squares / n - mean * mean) / (mean * mean + 1e-6) : HUGE_VAL;
      }
    }
  }
  std::size_t best = 0;
  for (std::size_t step = 1; step < cost.size(); ++step) {
    if (cost[step] < cost[best] * (1 - 1e-6)) best = step;
  }
  const double strength = static_cast<double>(best) / kSteps;
  for (std::size_t k = 0; k < images.size(); ++k) {
    for (FieldPlane& plane : images[k]) {
      for (std::size_t i = 0; i < plane.values.size(); ++i) plane.values[i] /= filter(all[k][i], strength);
    }
  }
  return static_cast<float>(strength);
}

}  // namespace btfc
