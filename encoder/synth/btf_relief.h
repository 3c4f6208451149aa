// A material sampled on a fine grid that wraps, and rays against its height field.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "encoder/dataset/direction.h"
#include "encoder/synth/btf_surface.h"

namespace btfc::procedural {

// Grid steps a texel and side: fibres are finer than a texel.
inline constexpr std::uint32_t kReliefSteps = 2;

// Microfacets and albedo of one grid point; heights and slopes lie apart.
struct Finish {
  float albedo[3], diffuse_roughness, specular, grain_x, grain_y, along, across, fuzz;
};

// Grid point (i, j) stands at ((i + 0.5) / kReliefSteps, (j + 0.5) / kReliefSteps) texels. In here lengths
// are in grid steps, x to the right, y downwards.
struct Relief {
  std::uint32_t columns = 0, rows = 0;
  float low = 0, high = 0;              // of the heights; their mean is 0
  std::vector<float> height;            // rows * columns
  std::vector<float> slope_x, slope_y;  // d height / dx and dy, central differences
  std::vector<Finish> finish;

  std::size_t size() const { return height.size(); }
};

// Of a tile of whole texels. Rows on all threads.
Relief sample_relief(const Surface& surface, std::uint32_t width, std::uint32_t height);

// The four grid points around a place and their weights.
struct Corners {
  std::array<std::uint32_t, 4> at;
  std::array<float, 4> weight;
};

// v modulo n, below n also where rounding would give n itself.
inline float wrapped_place(float v, float n) {
  const float rest = v - std::floor(v / n) * n;
  return rest >= 0 && rest < n ? rest : 0;
}

// x, y in grid steps, grid points at whole numbers, any place within 1e6 of the tile.
Corners corners_at(const Relief& relief, float x, float y);
float height_at(const Relief& relief, float x, float y);

// A direction above the plane in the grid's axes: y downwards.
struct ReliefDirection {
  float x = 0, y = 0, z = 1;
};
// By sine() and cosine(), so that no libm shows in the codes.
ReliefDirection relief_direction(const Direction& direction);

// Where the ray from direction `view` through (x, y) on the plane z = 0 first meets the relief.
struct Place {
  float x, y;
};
Place first_hit(const Relief& relief, const ReliefDirection& view, float x, float y);

}  // namespace btfc::procedural
