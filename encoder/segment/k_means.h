// k-means of a matrix' rows.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/linear/matrix.h"

namespace btfc {

struct KMeans {
  std::vector<std::uint16_t> cluster;  // one a row; every cluster has some
  Matrix centres;                      // a row a cluster: the mean of its rows by their weights
  double error = 0;                    // squared distances of rows from their centres by weights, summed
};

// Sum of squared differences of `count` values.
float squared_distance(const float* a, const float* b, std::size_t count);

// The centres and the error of rows that are in so many clusters. weights: one a row, or none: all alike.
KMeans means_of(const Matrix& rows, std::vector<std::uint16_t> cluster, std::size_t clusters,
                std::span<const double> weights = {});

// Lloyd's algorithm from k-means++, the best of four starts. clusters: 1 … 65536, at most as many as there
// are different rows. Uses the threads of the calling oneTBB arena; the result does not depend on them.
KMeans k_means(const Matrix& rows, std::size_t clusters, std::uint64_t seed,
               std::span<const double> weights = {});

}  // namespace btfc
