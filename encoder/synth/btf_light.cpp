// Horizons, shadows and the gathering of one diffuse bounce.
#include "encoder/synth/btf_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace btfc::procedural {
namespace {

// Half the angle that the lamp's disk fills, radians.
constexpr float kLampRadius = 0.035f;

// A quadrature of the hemisphere: azimuths by bands of equal solid angle, z in the middle of each.
constexpr int kAzimuths = 12, kBands = 4;

struct Vector2 {
  float x, y;
};
// Around the circle by the rational parametrisation is uneven; sine() is not.
std::array<Vector2, kAzimuths> azimuths() {
  constexpr double kPi = 3.14159265358979323846;
  std::array<Vector2, kAzimuths> out{};
  for (int k = 0; k < kAzimuths; ++k) {
    const double phi = 2 * kPi * (k + 0.5) / kAzimuths;
    out[static_cast<std::size_t>(k)] = {static_cast<float>(cosine(phi)), static_cast<float>(sine(phi))};
  }
  return out;
}

// The part of the lamp above the horizon, at most 75 degrees or so from the normal.
float visibility(const Relief& relief, std::uint32_t column, std::uint32_t row,
                 const ReliefDirection& light) {
  const float across = std::sqrt(light.x * light.x + light.y * light.y);
  if (across < 1e-6f) return 1;
  const float dx = light.x / across, dy = light.y / across, slope = light.z / across;
  const float h = relief.height[std::size_t{row} * relief.columns + column];
  // Nothing lower than the lamp's lower edge matters; tan(a - b) with tan b near b.
  const float lowest = std::max((slope - kLampRadius) / (1 + slope * kLampRadius), 0.05f);
  const float reach = (relief.high - h) / lowest;
  float horizon = 0;
  for (float t = 1; t < reach; t += 0.8f) {
    const float there =
        height_at(relief, static_cast<float>(column) + t * dx, static_cast<float>(row) + t * dy);
    horizon = std::max(horizon, (there - h) / t);
  }
  // Tangent of the angle between lamp and horizon.
  const float clear = (slope - horizon) / (1 + slope * horizon);
  const float part = std::clamp(0.5f + 0.5f * clear / kLampRadius, 0.0f, 1.0f);
  return part * part * (3 - 2 * part);
}

}  // namespace

BounceRays::BounceRays(const Relief& relief) : rows_(relief.rows) {
  const auto circle = azimuths();
  std::array<float, kBands> z{}, slope{};
  for (int b = 0; b < kBands; ++b) {
    const auto k = static_cast<std::size_t>(b);
    z[k] = (static_cast<float>(b) + 0.5f) / kBands;
    slope[k] = z[k] / std::sqrt(1 - z[k] * z[k]);
  }
  // Solid angle 2 pi / (kAzimuths kBands) over pi.
  constexpr float kSolid = 2.0f / (kAzimuths * kBands);
  tbb::parallel_for(std::uint32_t{0}, relief.rows, [&](std::uint32_t row) {
    Row& out = rows_[row];
    out.begin.reserve(relief.columns + 1);
    for (std::uint32_t column = 0; column < relief.columns; ++column) {
      out.begin.push_back(static_cast<std::uint32_t>(out.rays.size()));
      const std::size_t here = std::size_t{row} * relief.columns + column;
      const float h = relief.height[here], sx = relief.slope_x[here], sy = relief.slope_y[here];
      const float scale = 1 / std::sqrt(1 + sx * sx + sy * sy);
      for (const Vector2& d : circle) {
        const float reach = (relief.high - h) / slope[0];
        std::size_t band = 0;  // the lowest that has met nothing yet
        for (float t = 1; t < reach && band < kBands; t += 1) {
          const float x = static_cast<float>(column) + t * d.x, y = static_cast<float>(row) + t * d.y;
          const float horizon = (height_at(relief, x, y) - h) / t;
          if (horizon < slope[band]) continue;
          const Corners c = corners_at(relief, x + 0.5f, y + 0.5f);  // at[0]: the grid point nearest
          while (band < kBands && horizon >= slope[band]) {
            const float flat = std::sqrt(1 - z[band] * z[band]);
            const float cosine_here = (z[band] - flat * (sx * d.x + sy * d.y)) * scale;
            if (cosine_here > 0) out.rays.push_back({c.at[0], cosine_here * kSolid});
            ++band;
          }
        }
      }
    }
    out.begin.push_back(static_cast<std::uint32_t>(out.rays.size()));
  });
}

std::span<const BounceRays::Ray> BounceRays::at(std::uint32_t column, std::uint32_t row) const {
  const Row& r = rows_[row];
  return std::span<const Ray>(r.rays).subspan(r.begin[column], r.begin[column + 1] - r.begin[column]);
}

LightMaps light_maps(const Relief& relief, const BounceRays& rays, std::span<const ReliefDirection> lights) {
  const std::size_t n = lights.size();
  LightMaps out{n, std::vector<float>(relief.size() * 4 * n)};
  std::vector<float> direct(relief.size() * n);  // cosine times visibility
  tbb::parallel_for(std::uint32_t{0}, relief.rows, [&](std::uint32_t row) {
    for (std::uint32_t column = 0; column < relief.columns; ++column) {
      const std::size_t here = std::size_t{row} * relief.columns + column;
      const float sx = relief.slope_x[here], sy = relief.slope_y[here];
      const float scale = 1 / std::sqrt(1 + sx * sx + sy * sy);
      float* seen = &out.maps[here * 4 * n];
      for (std::size_t l = 0; l < n; ++l) {
        const ReliefDirection& light = lights[l];
        seen[l] = visibility(relief, column, row, light);
        direct[here * n + l] = seen[l] * std::max((light.z - sx * light.x - sy * light.y) * scale, 0.0f);
      }
    }
  });
  tbb::parallel_for(std::uint32_t{0}, relief.rows, [&](std::uint32_t row) {
    for (std::uint32_t column = 0; column < relief.columns; ++column) {
      float* red = &out.maps[(std::size_t{row} * relief.columns + column) * 4 * n + n];
      float *green = red + n, *blue = green + n;
      for (const BounceRays::Ray& ray : rays.at(column, row)) {
        const float* from = &direct[ray.from * n];
        const float* albedo = relief.finish[ray.from].albedo;
        const float r = ray.weight * albedo[0], g = ray.weight * albedo[1], b = ray.weight * albedo[2];
        for (std::size_t l = 0; l < n; ++l) {
          red[l] += r * from[l];
          green[l] += g * from[l];
          blue[l] += b * from[l];
        }
      }
    }
  });
  return out;
}

}  // namespace btfc::procedural
