// The Karhunen-Loeve transform of a texture's channels (paper eqs 1 and 2).
#pragma once
#include <optional>
#include <vector>

#include "encoder/fields/plane.h"
#include "encoder/linear/matrix.h"

namespace btfc {

struct ColourFactors {
  std::vector<double> mean;         // of the channels
  MatrixD basis;                    // channels x factors, columns orthonormal by falling variance
  std::vector<FieldPlane> factors;  // of the channels less their mean
};

// like: a basis whose columns' signs this one's take, so that subspaces driven by the same noise agree;
// without it each column's sum is not negative.
ColourFactors colour_factors(const std::vector<FieldPlane>& channels, const std::optional<MatrixD>& like);

}  // namespace btfc
