// Which neighbours a level's models use: one neighbourhood for all subspaces.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "encoder/fields/neighbour_moments.h"

namespace btfc {

// Adds the candidate that raises the evidence of all subspaces' models together most (Schwarz's
// approximation: log likelihood less half a logarithm of the samples for each coefficient), until none does
// or `most` are in. order: exactly so many, whatever the evidence. moments: one a subspace, of one plane
// each; those of more planes are taken by their sums.
std::uint64_t choose_neighbourhood(std::span<const NeighbourMoments> moments,
                                   std::optional<std::uint32_t> order, std::uint32_t most);

}  // namespace btfc
