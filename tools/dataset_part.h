// Some of a data set's pairs and texels, as a data set of its own.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

struct TexelWindow {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

// The pairs by number, ascending; directions that none of them has are left out, and weights are scaled to
// mean 1. A window that is not the whole tile does not wrap.
Result<Dataset> dataset_part(const Dataset& whole, const std::vector<std::size_t>& pairs,
                             const TexelWindow& window, const std::string& scratch_directory);

// At most about `most` pairs, evenly: every n-th, with n prime to the number of lights, so that all
// directions have their share.
std::vector<std::size_t> spread_pairs(const DatasetInfo& info, std::size_t most);

// All pairs of about `most` of the views, evenly: models that treat views apart then see of a view what they
// would see of the whole.
std::vector<std::size_t> pairs_of_views(const DatasetInfo& info, std::size_t most);

}  // namespace btfc
