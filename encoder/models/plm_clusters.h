// Codebooks of lobes for one view and channel (survey, Fig. 13): k-means whose distance is the error that a
// lobe causes on the measured values, lights by their weights.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/linear/matrix.h"
#include "encoder/models/plm_lobes.h"

namespace btfc {

// Row m of parameters[…]: kLobeParameters rows of `entries` values each.
struct LobeBook {
  std::size_t entries = 0;
  std::vector<float> parameters;  // parameter m of entry k at m entries + k
};

// values: a row a texel, a column a light. At most as many entries as texels. A cluster's lobe is fitted to
// the mean of its texels' values, which is the lobe of least error for them together; a cluster that empties
// goes on with the texel of the largest error. steps: as of refine_lobes, of the last fit.
LobeBook fit_book(const LobeLights& view, const Matrix& values, std::size_t entries, unsigned steps);

// The entry of least error for each texel.
std::vector<std::uint8_t> nearest_entries(const LobeLights& view, const Matrix& values, const LobeBook& book);

}  // namespace btfc
