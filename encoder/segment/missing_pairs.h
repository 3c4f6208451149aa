// Subspaces for pairs of directions that were not measured.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

// The subspace of every view under every light, view by view. A pair that was not measured gets the mean colour that the
// measured ones around it suggest: their means weighted by d^-4, d^2 the squared distance of views and lights as
// unit vectors, where the pair may also be turned about the normal (a material looks much the same from all
// sides; a turn counts as a quarter of its chord) and mirrored by exchanging view and light (Helmholtz, at a
// little cost too). It then goes to the subspace whose medoid image has the nearest mean. (The paper, section 4: "the
// method allows also a BTF data space restoration".)
std::vector<std::uint16_t> complete_index(const Dataset& dataset, const std::vector<std::uint16_t>& of_pair,
                                          const std::vector<std::size_t>& medoids);

}  // namespace btfc
