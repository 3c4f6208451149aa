// Surfaces that btfc render shows textures on.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "format/result.h"

namespace btfc {

// normal and tangent are unit vectors at right angles; the tangent is the direction of growing u. v grows
// downwards in the texture: against cross(normal, tangent).
struct ShapeVertex {
  std::array<float, 3> position, normal, tangent;
  std::array<float, 2> uv;
};

// Within a ball of radius 1 about the origin, y upwards; triangles are counter-clockwise from outside.
struct ShapeMesh {
  std::vector<ShapeVertex> vertices;
  std::vector<std::uint32_t> triangles;  // three vertices each
};

struct SurfacePoint {
  Vector3 position, normal, tangent;
};

struct ShapeKind {
  const char* name;
  const char* summary;
  SurfacePoint (*point)(double u, double v);  // u, v: 0 … 1
  std::uint32_t columns, rows;                // of the mesh
  double length_u, length_v;  // of the surface along u and v, where the texture is least stretched
  double tilt;                // degrees that its top leans towards the viewer
  bool from_afar;  // seen by parallel rays, at the scale that its breadth is the picture's; otherwise in
                   // perspective
};

std::span<const ShapeKind> shape_kinds();

// An error lists the names.
Result<const ShapeKind*> shape_kind(const std::string& name);

// The texture lies on it repeat_u x repeat_v times.
ShapeMesh make_mesh(const ShapeKind& kind, double repeat_u, double repeat_v);

}  // namespace btfc
