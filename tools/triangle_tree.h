// Triangles that rays are cast at, in a tree of boxes.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "encoder/dataset/direction.h"

namespace btfc {

using Triangle3 = std::array<Vector3, 3>;

struct TriangleHit {
  double distance = 0;  // in lengths of the ray's direction
  double u = 0, v = 0;  // weights of the second and the third corner
  std::size_t triangle = 0;
};

class TriangleTree {
 public:
  explicit TriangleTree(std::vector<Triangle3> triangles);
  // The nearest hit from either side, farther than `least`.
  std::optional<TriangleHit> hit(const Vector3& origin, const Vector3& direction, double least) const;

 private:
  struct Box {
    Vector3 low, high;
  };
  struct Node {
    Box box;
    std::size_t first = 0, count = 0;  // triangles of a leaf, in order_
    std::size_t right = 0;             // of an inner node; the left child follows it
  };
  std::size_t build(std::size_t first, std::size_t count);
  std::vector<Triangle3> triangles_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace btfc
