// Median cut over a table of sums.
#include "tools/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace btfc {
namespace {

constexpr double kPi = std::numbers::pi;

// Columns x0 … x1 - 1 of rows y0 … y1 - 1.
struct Region {
  std::uint32_t x0, y0, x1, y1;
};

class Environment {
 public:
  explicit Environment(const Image& image) : image_(image) {
    const std::size_t stride = std::size_t{image.width} + 1;
    sums_.assign(stride * (std::size_t{image.height} + 1), 0);
    for (std::uint32_t y = 0; y < image.height; ++y) {
      double row = 0;
      for (std::uint32_t x = 0; x < image.width; ++x) {
        const std::array<double, 3> c = colour(x, y);
        row += (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]) * solid_angle(y);
        sums_[(y + 1) * stride + x + 1] = sums_[y * stride + x + 1] + row;
      }
    }
  }

  Region whole() const { return {0, 0, image_.width, image_.height}; }

  double luminous(const Region& r) const {
    const std::size_t stride = std::size_t{image_.width} + 1;
    const auto at = [&](std::uint32_t x, std::uint32_t y) { return sums_[y * stride + x]; };
    return at(r.x1, r.y1) - at(r.x0, r.y1) - at(r.x1, r.y0) + at(r.x0, r.y0);
  }

  // Two regions of as much light as may be, cut across the longer side as it lies on the sphere.
  std::pair<Region, Region> cut(const Region& r) const {
    const double latitude = kPi * (0.5 * (r.y0 + r.y1) / image_.height - 0.5);
    const double breadth = 2 * kPi * (r.x1 - r.x0) / image_.width * std::cos(latitude);
    const double height = kPi * (r.y1 - r.y0) / image_.height;
    const bool across_x = r.y1 - r.y0 < 2 || (r.x1 - r.x0 > 1 && breadth >= height);
    const double half = 0.5 * luminous(r);
    Region a = r, b = r;
    std::uint32_t &end = across_x ? a.x1 : a.y1, &begin = across_x ? b.x0 : b.y0;
    const std::uint32_t last = end;
    begin = end = (across_x ? r.x0 : r.y0) + 1;
    while (end + 1 < last && luminous(a) < half) begin = ++end;
    return {a, b};
  }

  RenderLight light(const Region& r) const {
    std::array<double, 3> sum{}, towards{};
    for (std::uint32_t y = r.y0; y < r.y1; ++y) {
      const double colatitude = kPi * (y + 0.5) / image_.height;
      for (std::uint32_t x = r.x0; x < r.x1; ++x) {
        const double longitude = 2 * kPi * ((x + 0.5) / image_.width - 0.5);
        const std::array<double, 3> c = colour(x, y);
        const double weight = (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]) * solid_angle(y);
        towards[0] += weight * std::sin(colatitude) * std::sin(longitude);
        towards[1] += weight * std::cos(colatitude);
        towards[2] -= weight * std::sin(colatitude) * std::cos(longitude);
        for (std::size_t i = 0; i < 3; ++i) sum[i] += c[i] * solid_angle(y) / kPi;
      }
    }
    const double length = std::hypot(towards[0], towards[1], towards[2]);
    RenderLight light{};
    for (std::size_t i = 0; i < 3; ++i) {
      light.direction[i] = static_cast<float>(length > 0 ? towards[i] / length : (i == 1 ? 1.0 : 0.0));
      light.strength[i] = static_cast<float>(sum[i]);
    }
    return light;
  }

 private:
  std::array<double, 3> colour(std::uint32_t x, std::uint32_t y) const {
    std::array<double, 3> c;
    for (std::uint32_t i = 0; i < 3; ++i)
      c[i] = std::max(0.0f, code_value(image_.type, image_.at(x, y, image_.channels < 3 ? 0 : i)));
    return c;
  }

  double solid_angle(std::uint32_t y) const {
    return 2 * kPi / image_.width *
           (std::cos(kPi * y / image_.height) - std::cos(kPi * (y + 1) / image_.height));
  }

  const Image& image_;
  std::vector<double> sums_;  // of light over solid angle, above and to the left of (x, y)
};

}  // namespace

Result<std::vector<RenderLight>> environment_lights(const Image& image, std::uint32_t count) {
  const Environment environment(image);
  std::vector<Region> regions = {environment.whole()};
  while (regions.size() < count) {
    // What one texel lights cannot be cut.
    const auto worth = [&](const Region& r) {
      return r.x1 - r.x0 > 1 || r.y1 - r.y0 > 1 ? environment.luminous(r) : -1.0;
    };
    const auto most = std::max_element(regions.begin(), regions.end(),
                                       [&](const Region& a, const Region& b) { return worth(a) < worth(b); });
    if (worth(*most) <= 0) break;
    const auto [a, b] = environment.cut(*most);
    *most = a;
    regions.push_back(b);
  }
  std::vector<RenderLight> lights;
  for (const Region& region : regions) {
    if (environment.luminous(region) > 0) lights.push_back(environment.light(region));
  }
  if (lights.empty()) return bad_data("the environment is black");
  return lights;
}

}  // namespace btfc
