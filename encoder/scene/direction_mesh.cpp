// The decoder's own tables, asked by the decoder's own function.
#include "encoder/scene/direction_mesh.h"

#include <set>

#include "shaders/btfc_directions.h"

namespace btfc {

DirectionMesh::DirectionMesh(std::span<const Direction> directions) {
  Directions d;
  std::set<DirectionPoint> seen;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const DirectionPoint point = point_of(directions[i].theta, directions[i].phi);
    if (!seen.insert(point).second) continue;
    d.views.push_back(point);
    number_.push_back(i);
    vectors_.push_back(btfc::unit_vector(directions[i]));
  }
  d.lights = {DirectionPoint{}};
  d.pairs = all_pairs(d.views.size(), 1);
  at_ = append_direction_words(d, words_);
}

std::vector<DirectionShare> DirectionMesh::corners(const Vector3& v) const {
  const vec3 direction(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
  const BtfcCorners found = btfc_corners({{words_.data()}}, at_.views, direction);
  std::vector<DirectionShare> shares;
  for (int i = 0; i < 3; ++i) {
    if (found.weight[i] > 0)
      shares.push_back({number_[found.index[i]], static_cast<double>(found.weight[i])});
  }
  return shares;
}

std::vector<DirectionShare> DirectionMesh::answer(const Vector3& direction, double most) const {
  std::size_t nearest = 0;
  double cosine = -2;
  for (std::size_t i = 0; i < vectors_.size(); ++i) {
    const Vector3& v = vectors_[i];
    const double c = v[0] * direction[0] + v[1] * direction[1] + v[2] * direction[2];
    if (c > cosine) {
      cosine = c;
      nearest = i;
    }
  }
  if (angle_between(direction_from_vector(vectors_[nearest]), direction_from_vector(direction)) <= most)
    return {{number_[nearest], 1.0}};
  return corners(direction);
}

}  // namespace btfc
