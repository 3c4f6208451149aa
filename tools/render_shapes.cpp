// The surfaces as functions of u and v, and their meshes.
#include "tools/render_shapes.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace btfc {
namespace {

constexpr double kPi = std::numbers::pi;

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector3 unit(const Vector3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

// u runs along the equator, its ends meet at the back.
SurfacePoint sphere_point(double u, double v) {
  constexpr double kRadius = 0.94;
  const double longitude = 2 * kPi * (u - 0.5), colatitude = kPi * v;
  const double across = std::sin(colatitude);
  const Vector3 normal = {across * std::sin(longitude), std::cos(colatitude), across * std::cos(longitude)};
  return {{kRadius * normal[0], kRadius * normal[1], kRadius * normal[2]},
          normal,
          {std::cos(longitude), 0, -std::sin(longitude)}};
}

// A horizontal square, its image's top away from the viewer.
constexpr double kPlaneSide = 1.5;
SurfacePoint plane_point(double u, double v) {
  return {{kPlaneSide * (u - 0.5), 0, kPlaneSide * (v - 0.5)}, {0, 1, 0}, {1, 0, 0}};
}

// A square cloth on a table with a ball under its middle: folds run outwards from it.
constexpr double kClothSide = 1.5;
Vector3 cloth_position(double u, double v) {
  const double x = kClothSide * (u - 0.5), z = kClothSide * (v - 0.5);
  const double r = std::hypot(x, z), azimuth = std::atan2(z, x);
  const double ball = 0.55 * std::exp(-r * r / 0.16);
  const double grown = std::min(r / 0.7, 1.0), weight = grown * grown * (3 - 2 * grown);
  const double folds = 0.05 * std::sin(7 * azimuth + 2 * std::sin(azimuth)) + 0.03 * std::sin(9 * x + 5 * z);
  return {x, ball + weight * folds - 0.08, z};
}

SurfacePoint cloth_point(double u, double v) {
  constexpr double kStep = 1e-5;
  const auto slope = [&](double du, double dv) {
    const Vector3 a = cloth_position(u - du, v - dv), b = cloth_position(u + du, v + dv);
    return Vector3{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  };
  const Vector3 along = unit(slope(kStep, 0));
  return {cloth_position(u, v), unit(cross(slope(0, kStep), along)), along};
}

constexpr ShapeKind kKinds[] = {
    {"sphere", "the texture wrapped around a ball", sphere_point, 256, 128, 2 * kPi * 0.94, kPi * 0.94, 0,
     false},
    {"plane", "a square, tilted", plane_point, 1, 1, kPlaneSide, kPlaneSide, 55, false},
    {"cloth", "a square cloth draped over a ball on a table", cloth_point, 384, 384, kClothSide, kClothSide,
     30, false},
    {"swatch", "a square seen head-on from afar, filling the picture", plane_point, 1, 1, kPlaneSide,
     kPlaneSide, 90, true},
};

template <std::size_t count>
std::array<float, count> floats(const std::array<double, count>& from) {
  std::array<float, count> to;
  for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<float>(from[i]);
  return to;
}

}  // namespace

std::span<const ShapeKind> shape_kinds() { return kKinds; }

Result<const ShapeKind*> shape_kind(const std::string& name) {
  std::string names;
  for (const ShapeKind& kind : kKinds) {
    if (name == kind.name) return &kind;
    names += (names.empty() ? "" : ", ") + std::string(kind.name);
  }
  return bad_argument(fmt::format("there is no shape '{}', expected one of {}", name, names));
}

ShapeMesh make_mesh(const ShapeKind& kind, double repeat_u, double repeat_v) {
  ShapeMesh mesh;
  for (std::uint32_t row = 0; row <= kind.rows; ++row) {
    for (std::uint32_t column = 0; column <= kind.columns; ++column) {
      const double u = double{1} * column / kind.columns, v = double{1} * row / kind.rows;
      const SurfacePoint point = kind.point(u, v);
      // At right angles to the normal.
      const Vector3 bitangent = cross(point.normal, point.tangent);
      const Vector3 tangent = unit(cross(bitangent, point.normal));
      mesh.vertices.push_back({floats(point.position), floats(point.normal), floats(tangent),
                               floats(std::array<double, 2>{repeat_u * u, repeat_v * v})});
    }
  }
  for (std::uint32_t row = 0; row < kind.rows; ++row) {
    for (std::uint32_t column = 0; column < kind.columns; ++column) {
      const std::uint32_t a = row * (kind.columns + 1) + column, b = a + 1, c = a + kind.columns + 1,
                          d = c + 1;
      for (const std::uint32_t vertex : {a, c, b, b, c, d}) mesh.triangles.push_back(vertex);
    }
  }
  return mesh;
}

}  // namespace btfc
