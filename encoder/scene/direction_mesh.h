// Measured directions as a decoder interpolates between them (spec/tables.md sections 3 and 4).
#pragma once
#include <span>
#include <vector>

#include "encoder/dataset/direction.h"
#include "format/directions.h"

namespace btfc {

// A direction's share in an answer.
struct DirectionShare {
  std::size_t index = 0;
  double weight = 0;  // above 0
};

class DirectionMesh {
 public:
  // At least one. Of directions whose points are alike the first stands for all.
  explicit DirectionMesh(std::span<const Direction> directions);

  // The measured directions that a decoder answers from, one to three; weights sum to 1.
  std::vector<DirectionShare> corners(const Vector3& direction) const;
  // The nearest one, if it is within `most` radians, else the corners.
  std::vector<DirectionShare> answer(const Vector3& direction, double most) const;

 private:
  std::vector<Vector3> vectors_;
  std::vector<std::size_t> number_;  // of each point, in the directions given
  DirectionWords at_;
  std::vector<std::uint32_t> words_;
};

}  // namespace btfc
