// Assign, fit a local PCA each, repeat.
#include "encoder/models/lpca_clusters.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "encoder/linear/row_blocks.h"
#include "encoder/linear/row_clusters.h"

namespace btfc {
namespace {

struct LocalPca {
  Eigen::RowVectorXf mean;
  Matrix basis;  // dimensions x rank, orthonormal columns; zero columns where the members span less
};

using Members = std::vector<std::vector<std::size_t>>;

Members members_of(const std::vector<std::uint16_t>& cluster, std::uint32_t clusters) {
  Members members(clusters);
  for (std::size_t i = 0; i < cluster.size(); ++i) members[cluster[i]].push_back(i);
  return members;
}

LocalPca local_pca(const Matrix& vectors, const std::vector<std::size_t>& members, std::uint32_t rank) {
  const Eigen::Index dimensions = vectors.cols(), count = as_index(members.size());
  Matrix rows(count, dimensions);
  for (Eigen::Index i = 0; i < count; ++i)
    rows.row(i) = vectors.row(as_index(members[static_cast<std::size_t>(i)]));
  LocalPca pca;
  pca.mean = rows.cast<double>().colwise().mean().cast<float>();
  rows.rowwise() -= pca.mean;
  pca.basis = Matrix::Zero(dimensions, as_index(rank));
  const Eigen::Index kept = std::min({as_index(rank), dimensions, count - 1});
  if (kept < 1) return pca;
  // The smaller of the two Gram matrices.
  const bool by_rows = count < dimensions;
  const Matrix gram = by_rows ? Matrix(rows * rows.transpose()) : Matrix(rows.transpose() * rows);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> eigen(gram);
  const float least = 1e-6f * std::max(eigen.eigenvalues()(gram.rows() - 1), 0.0f);
  for (Eigen::Index k = 0; k < kept; ++k) {
    const Eigen::Index at = gram.rows() - 1 - k;
    if (eigen.eigenvalues()(at) <= least) break;
    const Eigen::VectorXf vector = eigen.eigenvectors().col(at);
    pca.basis.col(k) = by_rows ? Eigen::VectorXf((rows.transpose() * vector).normalized()) : vector;
  }
  return pca;
}

// The cluster that shows each vector best, and its squared error there.
RowClusters assign(const Matrix& vectors, const std::vector<LocalPca>& pcas) {
  const auto count = static_cast<std::size_t>(vectors.rows());
  RowClusters best{std::vector<std::uint16_t>(count), std::vector<float>(count)};
  constexpr std::size_t kRows = 256;
  tbb::parallel_for(std::size_t{0}, (count + kRows - 1) / kRows, [&](std::size_t block) {
    const std::size_t first = block * kRows, rows = std::min(kRows, count - first);
    Matrix centred(as_index(rows), vectors.cols()), shown;
    for (std::size_t m = 0; m < pcas.size(); ++m) {
      centred = vectors.middleRows(as_index(first), as_index(rows)).rowwise() - pcas[m].mean;
      shown.noalias() = centred * pcas[m].basis;
      for (std::size_t r = 0; r < rows; ++r) {
        const auto row = as_index(r);
        const float error = std::max(0.0f, centred.row(row).squaredNorm() - shown.row(row).squaredNorm());
        if (m > 0 && error >= best.error[first + r]) continue;
        best.error[first + r] = error;
        best.cluster[first + r] = static_cast<std::uint16_t>(m);
      }
    }
  });
  return best;
}

// A cluster each around single vectors.
std::vector<LocalPca> first_centres(const Matrix& vectors, std::uint32_t clusters, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<LocalPca> centres;
  for (const std::size_t i : spread_rows(vectors, clusters, uniform))
    centres.push_back({vectors.row(as_index(i)), Matrix::Zero(vectors.cols(), 1)});
  return centres;
}

std::vector<LocalPca> fit_all(const Matrix& vectors, const RowClusters& a, std::uint32_t clusters,
                              std::uint32_t rank) {
  const Members members = members_of(a.cluster, clusters);
  std::vector<LocalPca> pcas(clusters);
  tbb::parallel_for(std::size_t{0}, std::size_t{clusters},
                    [&](std::size_t m) { pcas[m] = local_pca(vectors, members[m], rank); });
  return pcas;
}

LpcaClusters clusters_from(const Matrix& vectors, const LpcaClusterOptions& options, std::uint64_t seed) {
  RowClusters a = assign(vectors, first_centres(vectors, options.clusters, seed));
  fill_empty(a, options.clusters);
  // Local PCAs of full rank show their own members too well to let any go: the rank grows step by step.
  constexpr int kSteps = 6;
  for (std::uint32_t rank = 0; rank < options.rank; rank = std::max(1u, 2 * rank)) {
    for (int step = 0; step < kSteps; ++step) {
      a = assign(vectors, fit_all(vectors, a, options.clusters, rank));
      fill_empty(a, options.clusters);
    }
  }
  LpcaClusters result;
  double before = std::numeric_limits<double>::infinity();
  for (result.iterations = 1;; ++result.iterations) {
    a = assign(vectors, fit_all(vectors, a, options.clusters, options.rank));
    fill_empty(a, options.clusters);
    result.error = 0;
    for (const float e : a.error) result.error += static_cast<double>(e);
    if (options.progress) options.progress(result.iterations, options.most_iterations);
    if (before - result.error <= options.tolerance * result.error ||
        result.iterations == options.most_iterations)
      break;
    before = result.error;
  }
  result.cluster = std::move(a.cluster);
  return result;
}

}  // namespace

LpcaClusters lpca_clusters(const Matrix& vectors, const LpcaClusterOptions& options) {
  use_blas_single_threaded();
  LpcaClusters best;
  for (std::uint64_t start = 0; start < options.starts; ++start) {
    LpcaClusters found = clusters_from(vectors, options, options.seed + start);
    if (start == 0 || found.error < best.error) best = std::move(found);
  }
  return best;
}

}  // namespace btfc
