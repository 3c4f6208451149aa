// What a field's model says of itself once its levels are settled: the standard deviations of its factors by
// level, and the signatures of its subspaces.
#pragma once
#include <array>
#include <vector>

#include "format/loaded_item.h"
#include "shaders/models/field.h"

namespace btfc {

// variance[m] of the collapsed factor at level m, levels finer than m left out; of gmrf over the torus, of
// the others the stationary solution's, averaged over the phases of the pyramid.
std::vector<double> factor_variances(const LoadedItem& item, const FieldParams& p, std::uint32_t subspace,
                                     std::uint32_t factor);

// Four numbers a subspace: three of the leading eigenvectors of the covariance between subspaces' deviations
// (over texels and channels of one window of the same noise), and the root of what they leave.
std::vector<std::array<float, 4>> subspace_signatures(const LoadedItem& item, const FieldParams& p);

}  // namespace btfc
