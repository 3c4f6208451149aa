// Subspaces for pairs of directions that were not measured.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

// The subspace of every view under every light, view by view. A pair that was not measured gets the mean
// colour that the measured ones around it suggest: their means weighted by D^-4, D the sum of the squared
// distances of views and of lights as unit vectors. The measured pair may also be turned about the normal,
// which counts 0.7 of its chord (a material looks much the same from all sides), or be mirrored by exchanging
// view and light (Helmholtz), which counts as a D of 0.5. It then goes to the subspace whose medoid image has
// the nearest mean. (The paper, section 4: "the method allows also a BTF data space restoration".)
std::vector<std::uint16_t> complete_index(const Dataset& dataset, const std::vector<std::uint16_t>& of_pair,
                                          const std::vector<std::size_t>& medoids);

}  // namespace btfc
