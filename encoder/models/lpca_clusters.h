// Clustering of vectors by local PCA: k-means with the reconstruction error as distance (Mueller, Meseth,
// Klein 2003, as in the survey's section 4.2.3).
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "encoder/linear/matrix.h"

namespace btfc {

struct LpcaClusters {
  std::vector<std::uint16_t> cluster;  // one a vector; every cluster has some
  double error = 0;                    // squared, summed over all vectors
  std::size_t iterations = 0;
};

struct LpcaClusterOptions {
  std::uint32_t clusters = 8;
  std::uint32_t rank = 8;
  std::size_t most_iterations = 30;
  std::uint32_t starts = 3;  // the best of so many seeds
  double tolerance = 1e-4;   // iteration ends where the error falls by less than this share
  std::uint64_t seed = 1;
  std::function<void(std::size_t done, std::size_t total)> progress;
};

// vectors: a row each, at least one and as many as there are clusters. Starts from k-means++ and
// local PCAs of rank 0, 1, 2, 4 … A cluster that loses all its vectors gets the one with the largest error.
// The error never rises but by that. Deterministic on any number of threads.
LpcaClusters lpca_clusters(const Matrix& vectors, const LpcaClusterOptions& options);

}  // namespace btfc
