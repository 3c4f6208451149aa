// Surfaces that a scene's camera looks at, with the frame that a texture has on them.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "encoder/dataset/direction.h"
#include "format/result.h"

namespace btfc {

struct SurfaceHit {
  double distance = 0;  // in lengths of the ray's direction
  Vector3 position;
  Vector3 normal, right, top;  // unit vectors: along the normal, the image's right and its top
  double texels_per_unit = 0;  // how dense the texture lies there
};

// The nearest hit of a ray, farther than `least`.
using Surface =
    std::function<std::optional<SurfaceHit>(const Vector3& origin, const Vector3& direction, double least)>;

// A rectangle in z = 0 about the origin, seen from above: right is x, top is y.
Surface plane_surface(double width, double height, double texels_per_unit);
// About the origin; the texture's top points to +z, its right to the east.
Surface sphere_surface(double radius, double texels_per_unit);
// An OBJ file with texture coordinates, of which a unit has so many texels. Normals are the triangles' own.
Result<Surface> mesh_surface(const std::string& path, double texels_u, double texels_v);

}  // namespace btfc
