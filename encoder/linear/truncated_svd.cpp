// Subspace iteration on A^T A, one reading of A a step.
#include "encoder/linear/truncated_svd.h"

#include <algorithm>
#include <array>
#include <random>

namespace btfc {
namespace {

// A basis of the space that the columns span.
Matrix orthonormal(const Matrix& columns) {
  // Twice, in double by way of QR: single precision loses small components beside large ones.
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns.cast<double>());
  const Eigen::MatrixXd thin = qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
  return thin.cast<float>();
}

Matrix gaussian(std::size_t rows, std::size_t columns, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  Matrix m(as_index(rows), as_index(columns));
  for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = normal(random);
  return m;
}

struct Step {
  MatrixD image;  // A^T A basis
  double total = 0;
};

Step multiply(const RowBlocks& matrix, const Matrix& basis) {
  Step step;
  step.image = MatrixD::Zero(basis.rows(), basis.cols());
  std::array<Matrix, kPartials> partial;
  std::array<double, kPartials> energy{};
  for_each_block(
      matrix,
      [&](const Matrix& block, std::size_t, std::size_t place) {
        const Matrix projected = block * basis;
        partial[place].noalias() = block.transpose() * projected;
        energy[place] = 0;
        for (Eigen::Index r = 0; r < block.rows(); ++r)
          energy[place] += static_cast<double>(block.row(r).squaredNorm());
      },
      [&](std::size_t place) {
        step.image += partial[place].cast<double>();
        step.total += energy[place];
      });
  return step;
}

}  // namespace

TruncatedSvd truncated_svd(const RowBlocks& matrix, std::size_t rank, const SvdOptions& options) {
  const std::size_t smaller = std::min(matrix.rows, matrix.columns);
  rank = std::min(rank, smaller);
  TruncatedSvd svd;
  if (rank == 0) {
    svd.left = Matrix(as_index(matrix.rows), 0);
    svd.right = Matrix(as_index(matrix.columns), 0);
    return svd;
  }
  const std::size_t width = std::min(smaller, rank + std::max<std::size_t>(10, rank / 4));
  Matrix basis = orthonormal(gaussian(matrix.columns, width, options.seed));
  double before = 0;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
  for (svd.passes = 1;; ++svd.passes) {
    const Step step = multiply(matrix, basis);
    svd.total_energy = step.total;
    // The largest eigenvalues of A^T A within the space that `basis` spans.
    const Eigen::MatrixXd inner = basis.cast<double>().transpose() * step.image;
    ritz.compute((inner + inner.transpose()) / 2);
    const double captured = ritz.eigenvalues().tail(as_index(rank)).sum();
    if (options.progress) options.progress(svd.passes, options.most_passes);
    const bool still =
        captured - before <= options.tolerance * std::max(step.total - captured, 1e-7 * step.total);
    if (svd.passes > 1 && (still || svd.passes + 1 >= options.most_passes)) break;
    before = captured;
    basis = orthonormal(step.image.cast<float>());
  }
  // Components that single precision cannot tell from nothing are left out.
  const double largest = std::max(ritz.eigenvalues().tail(1)(0), 0.0);
  while (rank > 0 && ritz.eigenvalues()(as_index(width - rank)) <= 1e-12 * largest) --rank;
  Eigen::MatrixXd leading(as_index(width), as_index(rank));
  for (std::size_t k = 0; k < rank; ++k) {
    leading.col(as_index(k)) = ritz.eigenvectors().col(as_index(width - 1 - k));
    svd.energy.push_back(ritz.eigenvalues()(as_index(width - 1 - k)));
  }
  svd.right = (basis.cast<double>() * leading).cast<float>();
  svd.left.resize(as_index(matrix.rows), as_index(rank));
  for_each_block(
      matrix,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        svd.left.middleRows(as_index(number * matrix.block_rows), block.rows()).noalias() = block * svd.right;
      },
      [](std::size_t) {});
  ++svd.passes;
  return svd;
}

TruncatedSvd weighted_svd(const RowBlocks& matrix, std::span<const double> weights, std::size_t rank,
                          const SvdOptions& options) {
  TruncatedSvd svd = truncated_svd(weighted_columns(matrix, weights), rank, options);
  if (weights.empty() || svd.left.cols() == 0) return svd;
  // With `left` given, each column's row of `right` is a least squares problem of its own, which its weight
  // does not change: right = (left^T left)^-1 left^T A. To divide by the roots of weights gives the same in
  // exact arithmetic, but columns that hardly count are lost in the rounding of those that do.
  const Eigen::Index kept = svd.left.cols();
  const Eigen::VectorXd length = svd.left.cast<double>().colwise().norm();
  MatrixD gram = MatrixD::Zero(kept, kept), right = MatrixD::Zero(kept, as_index(matrix.columns));
  std::array<Matrix, kPartials> partial_gram, partial_right;
  for_each_block(
      matrix,
      [&](const Matrix& block, std::size_t number, std::size_t place) {
        const auto left = svd.left.middleRows(as_index(number * matrix.block_rows), block.rows());
        partial_gram[place].noalias() = left.transpose() * left;
        partial_right[place].noalias() = left.transpose() * block;
      },
      [&](std::size_t place) {
        gram += partial_gram[place].cast<double>();
        right += partial_right[place].cast<double>();
      });
  const Eigen::VectorXd unit = (length.array() > 0).select(length.cwiseInverse(), 0.0);
  const Eigen::MatrixXd scaled = unit.asDiagonal() * gram * unit.asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-5);  // of single precision sums
  solver.compute(scaled);
  const Eigen::MatrixXd solved = solver.solve(Eigen::MatrixXd(unit.asDiagonal() * right));
  svd.right = (solved.transpose() * unit.asDiagonal()).cast<float>();
  ++svd.passes;
  return svd;
}

}  // namespace btfc
