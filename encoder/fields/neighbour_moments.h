// Second moments of a level's texels and their candidate neighbours: all that the estimates of the models of
// random fields need.
#pragma once
#include <span>

#include "encoder/fields/plane.h"
#include "encoder/linear/matrix.h"
#include "format/models/field_shape.h"

namespace btfc {

// Means of products over `samples` texels; the planes' means are taken off first. Row and column
// s * planes + g: plane g at candidate s (causal), or the sum of both texels at +-offset (symmetric);
// the last `planes` rows and columns: the texel itself.
struct NeighbourMoments {
  MatrixD moments;
  double samples = 0;
  std::size_t planes = 1;
  Eigen::Index at(std::size_t candidate, std::size_t plane = 0) const {
    return as_index(candidate * planes + plane);
  }
  Eigen::Index own(std::size_t plane = 0) const { return as_index(kFieldCandidates * planes + plane); }
};

enum class Neighbourhood { causal, symmetric };

// Planes of one size. Texels whose neighbours lie outside do not count, unless the plane wraps or too few
// would be left: then it is taken as a torus.
NeighbourMoments neighbour_moments(std::span<const FieldPlane> planes, Neighbourhood kind, bool wraps);

}  // namespace btfc
