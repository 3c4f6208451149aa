// The triangulation that interpolation between directions goes by (spec/tables.md section 3).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace btfc {

// A direction by stereographic projection, in units of 2^-24: (x, y) / (1 + z). |x|, |y| <= 2^24.
struct DirectionPoint {
  std::int32_t x = 0, y = 0;
  auto operator<=>(const DirectionPoint&) const = default;
};

inline constexpr std::uint32_t kNoTriangle = UINT32_MAX;

struct Triangulation {
  struct Triangle {
    std::array<std::uint32_t, 3> corners;     // counter-clockwise
    std::array<std::uint32_t, 3> neighbours;  // across the side opposite each corner; kNoTriangle: none
  };
  std::vector<Triangle> triangles;
  // The convex hull's sides between neighbouring points on it, with the inside to the left; of points on one
  // line the chain along it; of one point (0, 0).
  std::vector<std::array<std::uint32_t, 2>> border;
};

// The Delaunay triangulation of at least one point, no two alike; of points on one circle those triangles
// that share the lowest numbered one. Exact integers: the set of triangles is a function of the points alone.
// Time grows with the square of the number of points at worst.
Triangulation triangulate(std::span<const DirectionPoint> points);

}  // namespace btfc
