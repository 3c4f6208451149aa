// Moments of the field that a level has to add to what the coarser levels give.
#pragma once
#include <span>

#include "encoder/fields/neighbour_moments.h"

namespace btfc {

// What a level of the Laplacian pyramid holds and the expanded coarser plane overlap in frequency and go
// together, while the levels' fields are independent: their powers add up, not their amplitudes. Where the
// bands meet the sum of the paper's planes so misses up to half of the power (a spectrum distance of 0.4 to
// 0.6 on stone and bark, where crops of one picture are 0.14 to 0.19 apart). So a level is fitted to the
// difference of the second moments of the Gaussian plane and of what the expanded coarser field will have,
// its autocovariance averaged over phases, r(s) = 1/4 sum over t of k(s - 2 t) r_coarse(t), k the
// autocorrelation of the kernel (1, 4, 6, 4, 1) / 8 both ways. Eigenvalues of the difference are kept above
// 10^-6 of their mean. fine and coarse: planes of one texture, as of neighbour_moments; the coarsest level
// has no coarse planes.
NeighbourMoments band_moments(std::span<const FieldPlane> fine, std::span<const FieldPlane> coarse,
                              Neighbourhood kind, bool wraps);

}  // namespace btfc
