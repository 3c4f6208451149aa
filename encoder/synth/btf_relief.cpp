// Sampling of materials, and the march of view rays.
#include "encoder/synth/btf_relief.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace btfc::procedural {

Relief sample_relief(const Surface& surface, std::uint32_t width, std::uint32_t height) {
  Relief r;
  r.columns = width * kReliefSteps;
  r.rows = height * kReliefSteps;
  const std::size_t columns = r.columns, size = columns * r.rows;
  r.height.resize(size);
  r.slope_x.resize(size);
  r.slope_y.resize(size);
  r.finish.resize(size);
  tbb::parallel_for(std::uint32_t{0}, r.rows, [&](std::uint32_t j) {
    for (std::uint32_t i = 0; i < r.columns; ++i) {
      const SurfacePoint p = surface((i + 0.5) / kReliefSteps, (j + 0.5) / kReliefSteps);
      const auto f = [](double v) { return static_cast<float>(v); };
      r.height[j * columns + i] = f(p.height * kReliefSteps);
      r.finish[j * columns + i] = {{f(p.albedo.r), f(p.albedo.g), f(p.albedo.b)},
                                   f(p.diffuse_roughness),
                                   f(p.specular),
                                   f(p.grain_x),
                                   f(p.grain_y),
                                   f(p.along),
                                   f(p.across),
                                   f(p.fuzz)};
    }
  });
  double sum = 0;
  for (const float h : r.height) sum += static_cast<double>(h);
  const auto mean = static_cast<float>(sum / static_cast<double>(size));
  for (float& h : r.height) h -= mean;
  const auto [low, high] = std::minmax_element(r.height.begin(), r.height.end());
  r.low = *low;
  r.high = *high;
  tbb::parallel_for(std::uint32_t{0}, r.rows, [&](std::uint32_t j) {
    const std::size_t up = (j == 0 ? r.rows - 1 : j - 1) * columns,
                      down = (j + 1 == r.rows ? 0 : j + 1) * columns;
    const std::size_t row = j * columns;
    for (std::size_t i = 0; i < columns; ++i) {
      const std::size_t left = i == 0 ? columns - 1 : i - 1, right = i + 1 == columns ? 0 : i + 1;
      r.slope_x[row + i] = 0.5f * (r.height[row + right] - r.height[row + left]);
      r.slope_y[row + i] = 0.5f * (r.height[down + i] - r.height[up + i]);
    }
  });
  return r;
}

Corners corners_at(const Relief& relief, float x, float y) {
  x = wrapped_place(x, static_cast<float>(relief.columns));
  y = wrapped_place(y, static_cast<float>(relief.rows));
  const auto i0 = static_cast<std::uint32_t>(x), j0 = static_cast<std::uint32_t>(y);
  const std::uint32_t i1 = i0 + 1 == relief.columns ? 0 : i0 + 1, j1 = j0 + 1 == relief.rows ? 0 : j0 + 1;
  const float u = x - static_cast<float>(i0), v = y - static_cast<float>(j0);
  const std::uint32_t top = j0 * relief.columns, bottom = j1 * relief.columns;
  return {{top + i0, top + i1, bottom + i0, bottom + i1},
          {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}

float height_at(const Relief& relief, float x, float y) {
  const Corners c = corners_at(relief, x, y);
  return relief.height[c.at[0]] * c.weight[0] + relief.height[c.at[1]] * c.weight[1] +
         relief.height[c.at[2]] * c.weight[2] + relief.height[c.at[3]] * c.weight[3];
}

ReliefDirection relief_direction(const Direction& d) {
  const double across = sine(d.theta);
  return {static_cast<float>(across * cosine(d.phi)), static_cast<float>(-across * sine(d.phi)),
          static_cast<float>(cosine(d.theta))};
}

Place first_hit(const Relief& relief, const ReliefDirection& view, float x, float y) {
  const float run_x = view.x / view.z, run_y = view.y / view.z;  // steps along the plane for one step up
  const float reach = (relief.high - relief.low) * std::sqrt(run_x * run_x + run_y * run_y);
  // Down from the highest point, at most 0.7 grid steps along the plane at a time.
  const int count = static_cast<int>(reach / 0.7f) + 1;
  const float drop = (relief.high - relief.low) / static_cast<float>(count);
  const auto above = [&](float z) { return z - height_at(relief, x + z * run_x, y + z * run_y); };
  float z1 = relief.high, gap1 = above(z1);
  if (gap1 > 0) {
    float z0 = z1, gap0 = gap1;
    for (int k = 1; k <= count && gap1 > 0; ++k) {
      z0 = z1;
      gap0 = gap1;
      z1 = relief.high - drop * static_cast<float>(k);
      gap1 = above(z1);
    }
    // The relief crosses between z0 and z1: regula falsi, halved where it creeps.
    for (int k = 0; k < 4 && gap1 < 0; ++k) {
      const float t = k % 2 == 0 ? gap0 / (gap0 - gap1) : 0.5f;
      const float z = z0 + (z1 - z0) * t, gap = above(z);
      if (gap > 0) {
        z0 = z;
        gap0 = gap;
      } else {
        z1 = z;
        gap1 = gap;
      }
    }
  }
  return {x + z1 * run_x, y + z1 * run_y};
}

}  // namespace btfc::procedural
