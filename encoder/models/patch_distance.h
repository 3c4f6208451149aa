// Squared distance between a boundary zone and a position of the sample, by SIMD.
#pragma once
#include <cstdint>

#include "encoder/models/patch_search.h"

namespace btfc {

// The exact sum of squared differences, or, where that exceeds limit, any number above limit: the sum is
// given up early.
std::uint64_t zone_distance(const MatchImage& sample, PatchPosition at, const BoundaryZone& zone,
                            std::uint64_t limit);

}  // namespace btfc
