// Rays against a plane, a sphere and the triangles of an OBJ file.
#include "tools/scene_surface.h"

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "tools/triangle_tree.h"
#include "tools/vector_math.h"

namespace btfc {
namespace {

struct TextureFrame {
  Vector3 normal, right, top;
  double texels_per_unit = 0;
};

struct Mesh {
  TriangleTree tree;
  std::vector<TextureFrame> frames;  // of each triangle
};

using Uv = std::array<double, 2>;

// From what a step in u and one in v are on the surface; nothing where a triangle or its image has no area.
std::optional<TextureFrame> frame_of(const Triangle3& t, const std::array<Uv, 3>& uv, double texels_u,
                                     double texels_v) {
  const Vector3 ab = minus(t[1], t[0]), ac = minus(t[2], t[0]), normal = cross(ab, ac);
  const double bu = uv[1][0] - uv[0][0], bv = uv[1][1] - uv[0][1], cu = uv[2][0] - uv[0][0],
               cv = uv[2][1] - uv[0][1];
  const double area = length(normal), image = bu * cv - bv * cu;
  if (area == 0 || image == 0) return std::nullopt;
  const Vector3 along_u =
      along({0, 0, 0}, 1 / image, minus(along({0, 0, 0}, cv, ab), along({0, 0, 0}, bv, ac)));
  TextureFrame frame;
  frame.normal = unit(normal);
  frame.right = unit(along(along_u, -dot(along_u, frame.normal), frame.normal));
  // A mirrored image keeps its own top.
  frame.top = cross(frame.normal, frame.right);
  if (image < 0) frame.top = along({0, 0, 0}, -1, frame.top);
  frame.texels_per_unit = std::sqrt(std::abs(image) * texels_u * texels_v / area);
  return frame;
}

}  // namespace

Surface plane_surface(double width, double height, double texels_per_unit) {
  return [=](const Vector3& origin, const Vector3& direction, double least) -> std::optional<SurfaceHit> {
    const double distance = -origin[2] / direction[2];
    if (!(distance > least)) return std::nullopt;
    const Vector3 at = along(origin, distance, direction);
    if (!(std::abs(at[0]) <= width / 2 && std::abs(at[1]) <= height / 2)) return std::nullopt;
    return SurfaceHit{distance, at, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, texels_per_unit};
  };
}

Surface sphere_surface(double radius, double texels_per_unit) {
  return [=](const Vector3& origin, const Vector3& direction, double least) -> std::optional<SurfaceHit> {
    const double a = dot(direction, direction), b = dot(origin, direction),
                 c = dot(origin, origin) - radius * radius, root = b * b - a * c;
    if (root < 0) return std::nullopt;
    double distance = (-b - std::sqrt(root)) / a;
    if (distance <= least) distance = (-b + std::sqrt(root)) / a;
    if (distance <= least) return std::nullopt;
    const Vector3 at = along(origin, distance, direction), normal = unit(at);
    const Vector3 east = cross({0, 0, 1}, normal);
    const Vector3 right = length(east) > 1e-9 ? unit(east) : Vector3{1, 0, 0};
    return SurfaceHit{distance, at, normal, right, cross(normal, right), texels_per_unit};
  };
}

Result<Surface> mesh_surface(const std::string& path, double texels_u, double texels_v) {
  tinyobj::ObjReader reader;
  if (!reader.ParseFromFile(path)) {
    std::string why = reader.Error();
    std::replace(why.begin(), why.end(), '\n', ' ');
    return io_error(fmt::format("'{}' is not read as an OBJ file: {}", path, why));
  }
  const tinyobj::attrib_t& attributes = reader.GetAttrib();
  std::vector<Triangle3> triangles;
  std::vector<TextureFrame> frames;
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    const auto& indices = shape.mesh.indices;
    for (std::size_t i = 0; i + 3 <= indices.size(); i += 3) {
      Triangle3 corners;
      std::array<Uv, 3> uv{};
      for (std::size_t k = 0; k < 3; ++k) {
        const tinyobj::index_t& index = indices[i + k];
        if (index.texcoord_index < 0)
          return bad_data(
              fmt::format("'{}' has a face without texture coordinates, expected vt at all", path));
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto at = 3 * static_cast<std::size_t>(index.vertex_index) + axis;
          corners[k][axis] = static_cast<double>(attributes.vertices[at]);
        }
        for (std::size_t axis = 0; axis < 2; ++axis) {
          const auto at = 2 * static_cast<std::size_t>(index.texcoord_index) + axis;
          uv[k][axis] = static_cast<double>(attributes.texcoords[at]);
        }
      }
      const auto frame = frame_of(corners, uv, texels_u, texels_v);
      if (!frame) continue;  // nothing of the texture shows there
      triangles.push_back(corners);
      frames.push_back(*frame);
    }
  }
  if (triangles.empty()) return bad_data(fmt::format("'{}' has no textured triangles", path));
  const auto mesh = std::make_shared<Mesh>(Mesh{TriangleTree(std::move(triangles)), std::move(frames)});
  return Surface(
      [mesh](const Vector3& origin, const Vector3& direction, double least) -> std::optional<SurfaceHit> {
        const auto hit = mesh->tree.hit(origin, direction, least);
        if (!hit) return std::nullopt;
        const TextureFrame& f = mesh->frames[hit->triangle];
        return SurfaceHit{hit->distance,    along(origin, hit->distance, direction), f.normal, f.right, f.top,
                          f.texels_per_unit};
      });
}

}  // namespace btfc
