// The patch search: which positions of the sample fit what has been synthesised so far (paper, section
// III.A).
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/models/patch_distance.h"
#include "encoder/models/patch_features.h"
#include "format/models/patch_payload.h"

namespace btfc {

// A run of texels of a patch's boundary zone: row v, from column u.
struct ZoneRun {
  std::uint32_t v, u, length;
};

// The boundary zone of a patch and what the texture shows there.
struct BoundaryZone {
  std::vector<ZoneRun> runs;
  std::vector<std::int16_t> values;  // the runs one after another, all channels
};

// Candidates in raster order of the sample: all positions whose distance is below the threshold delta of the
// paper, or, where there is none, all that share the smallest distance.
//
// The paper's d < delta = tau rms(zone) is compared as sum of squared differences < tau^2 * sum of squares:
// the number of values cancels.
using Candidates = std::vector<PatchPosition>;

// The exhaustive search as written in the paper: one double loop. The reference for find_candidates.
Candidates find_candidates_plain(const MatchImage& sample, std::uint32_t patch_size, const BoundaryZone& zone,
                                 double tau);

// The same result by SIMD over positions with early exit, on the threads of the calling oneTBB arena. The
// zone must show values within the sample's range, as a texture made of it does.
Candidates find_candidates(const SearchPlanes& sample, std::uint32_t patch_size, const BoundaryZone& zone,
                           double tau);

}  // namespace btfc
