// The leading singular vectors of a matrix that is read in blocks.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "encoder/linear/row_blocks.h"

namespace btfc {

// A ~ left right^T, columns by falling energy; right's columns are orthonormal.
struct TruncatedSvd {
  Matrix left;                 // rows x rank
  Matrix right;                // columns x rank
  std::vector<double> energy;  // rank squared singular values
  double total_energy = 0;     // squared Frobenius norm of the whole matrix
  std::size_t passes = 0;      // readings of the matrix
};

struct SvdOptions {
  std::uint64_t seed = 1;
  // Iteration ends once a pass adds less than this share of the energy that is left out: 0.001 moves the
  // truncated matrix' error by 0.004 dB a pass.
  double tolerance = 1e-3;
  std::size_t most_passes = 24;
  std::function<void(std::size_t done, std::size_t total)> progress;
};

// Randomised subspace iteration (Halko, Martinsson, Tropp 2011, algorithm 4.4) with as many spare dimensions
// as the larger of 10 and rank / 4. The rank found is at most `rank`, the matrix' sides, and its numerical
// rank in single precision. Sums over blocks are taken in double and in order: independent of the threads.
TruncatedSvd truncated_svd(const RowBlocks& matrix, std::size_t rank, const SvdOptions& options);

// The same with the least sum over columns of weight x squared error; none: truncated_svd. left's columns are
// orthogonal, right's under the weights; energies are weighted.
TruncatedSvd weighted_svd(const RowBlocks& matrix, std::span<const double> weights, std::size_t rank,
                          const SvdOptions& options);

}  // namespace btfc
