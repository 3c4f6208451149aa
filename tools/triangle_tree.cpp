// Boxes halved at the median; triangles by Moeller and Trumbore, 1997.
#include "tools/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tools/vector_math.h"

namespace btfc {
namespace {

constexpr std::size_t kLeaf = 4;

double middle(const Triangle3& t, std::size_t axis) { return t[0][axis] + t[1][axis] + t[2][axis]; }

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle3> triangles)
    : triangles_(std::move(triangles)), order_(triangles_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  if (!order_.empty()) build(0, order_.size());
}

std::size_t TriangleTree::build(std::size_t first, std::size_t count) {
  Box box{{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
  for (std::size_t i = first; i < first + count; ++i) {
    for (const Vector3& corner : triangles_[order_[i]]) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], corner[axis]);
        box.high[axis] = std::max(box.high[axis], corner[axis]);
      }
    }
  }
  const std::size_t node = nodes_.size();
  nodes_.push_back({box, first, count, 0});
  if (count <= kLeaf) return node;
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (box.high[i] - box.low[i] > box.high[axis] - box.low[axis]) axis = i;
  }
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(first + count / 2), at(first + count), [&](std::size_t a, std::size_t b) {
    return middle(triangles_[a], axis) < middle(triangles_[b], axis);
  });
  nodes_[node].count = 0;
  build(first, count / 2);
  const std::size_t right = build(first + count / 2, count - count / 2);
  nodes_[node].right = right;
  return node;
}

std::optional<TriangleHit> TriangleTree::hit(const Vector3& origin, const Vector3& direction,
                                             double least) const {
  std::optional<TriangleHit> best;
  double most = std::numeric_limits<double>::infinity();
  const auto enters = [&](const Box& box) {
    double from = least, to = most;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (direction[axis] == 0) {
        if (origin[axis] < box.low[axis] || origin[axis] > box.high[axis]) return false;
        continue;
      }
      const double a = (box.low[axis] - origin[axis]) / direction[axis],
                   b = (box.high[axis] - origin[axis]) / direction[axis];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return from <= to;
  };
  const auto meet = [&](std::size_t number) {
    const Triangle3& t = triangles_[number];
    const Vector3 ab = minus(t[1], t[0]), ac = minus(t[2], t[0]), p = cross(direction, ac);
    const double determinant = dot(ab, p);
    if (determinant == 0) return;
    const Vector3 from = minus(origin, t[0]), q = cross(from, ab);
    const double u = dot(from, p) / determinant, v = dot(direction, q) / determinant,
                 distance = dot(ac, q) / determinant;
    if (u < 0 || v < 0 || u + v > 1 || distance <= least || distance >= most) return;
    most = distance;
    best = TriangleHit{distance, u, v, number};
  };
  std::vector<std::size_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::size_t number = open.back();
    const Node& node = nodes_[number];
    open.pop_back();
    if (!enters(node.box)) continue;
    for (std::size_t i = node.first; i < node.first + node.count; ++i) meet(order_[i]);
    if (node.count == 0) open.insert(open.end(), {node.right, number + 1});
  }
  return best;
}

}  // namespace btfc
