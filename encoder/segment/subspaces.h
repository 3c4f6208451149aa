// Which images of a BTF one of them may stand for (Haindl, Filip, "A Fast Probabilistic BTF Model", section
// 2.1; Filip, Haindl 2009, section 5.3): k-means of the pairs of directions by their images' colours.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "format/result.h"

namespace btfc {

struct Subspaces {
  std::vector<std::uint16_t> of_pair;  // a pair's subspace, 0 … count-1; none is empty, sizes fall
  std::vector<std::size_t> medoid;     // per subspace the pair whose features are nearest to their mean
  double explained = 0;                // 1 - squared distances from the means over those from one mean of all
};

inline constexpr std::uint32_t kMostAutomaticSubspaces = 64;

// Features are colour_histograms; squared distances and means count by the pairs' weights. clusters: up to
// 65536; pairs whose features are equal share a subspace, so that there are at most as many as different
// features, and with at least that many each has its own.
//
// 0: the fewest, at most kMostAutomaticSubspaces, that a bisection finds to explain 90 % of the features'
// squared distances from their mean, or that leave a mean squared distance of 0.05, what a shift by 1 L*
// makes of values with a deviation of 5 L*. The papers take 10 to 20, as many as there are eigenimages with
// 95 % of the images' energy. That rule follows where the energy is and not what k-means can do: where images
// differ in brightness alone one eigenimage holds 95 %, and one image stands for none of the others.
//
// Deterministic on any number of threads of the calling oneTBB arena. progress: images read. Holds 128 bytes
// a pair and axis of the features (three of RGB, one of grey).
Result<Subspaces> segment_pairs(
    const Dataset& dataset, std::uint32_t clusters, std::uint64_t seed,
    const std::function<void(std::size_t done, std::size_t total)>& progress = {});

}  // namespace btfc
