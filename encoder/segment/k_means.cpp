// Assign, take means, repeat until little moves.
#include "encoder/segment/k_means.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "encoder/linear/row_clusters.h"
#include "encoder/split_mix.h"

namespace btfc {
namespace {

constexpr std::uint64_t kStarts = 4;
constexpr int kMostRounds = 100;
constexpr double kTolerance = 1e-4;  // rounds end where the error falls by less than this share

double weight_of(std::span<const double> weights, std::size_t row) {
  return weights.empty() ? 1.0 : weights[row];
}

// Of equally near centres the first.
RowClusters assign(const Matrix& rows, const Matrix& centres, std::span<const double> weights) {
  const auto count = static_cast<std::size_t>(rows.rows()), values = static_cast<std::size_t>(rows.cols());
  RowClusters found{std::vector<std::uint16_t>(count), std::vector<float>(count)};
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const float* const row = rows.data() + i * values;
    for (std::size_t m = 0; m < static_cast<std::size_t>(centres.rows()); ++m) {
      const float d = squared_distance(row, centres.data() + m * values, values);
      if (m > 0 && d >= found.error[i]) continue;
      found.error[i] = d;
      found.cluster[i] = static_cast<std::uint16_t>(m);
    }
    found.error[i] *= static_cast<float>(weight_of(weights, i));
  });
  return found;
}

KMeans k_means_once(const Matrix& rows, std::size_t clusters, std::uint64_t seed,
                    std::span<const double> weights) {
  SplitMix64 random(seed);
  const auto drawn = spread_rows(
      rows, clusters, [&] { return random.uniform(); }, weights);
  Matrix first(as_index(clusters), rows.cols());
  for (std::size_t m = 0; m < clusters; ++m) first.row(as_index(m)) = rows.row(as_index(drawn[m]));
  RowClusters found = assign(rows, first, weights);
  fill_empty(found, clusters);
  KMeans result = means_of(rows, std::move(found.cluster), clusters, weights);
  for (int round = 1; round < kMostRounds; ++round) {
    found = assign(rows, result.centres, weights);
    fill_empty(found, clusters);
    const double before = result.error;
    result = means_of(rows, std::move(found.cluster), clusters, weights);
    if (before - result.error <= kTolerance * before) break;
  }
  return result;
}

}  // namespace

float squared_distance(const float* a, const float* b, std::size_t count) {
  constexpr std::size_t kLanes = 8;  // sums that a processor takes side by side
  std::array<float, kLanes> sums{};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float d = a[i + l] - b[i + l];
      sums[l] += d * d;
    }
  }
  float sum = 0;
  for (const float s : sums) sum += s;
  for (; i < count; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

KMeans means_of(const Matrix& rows, std::vector<std::uint16_t> cluster, std::size_t clusters,
                std::span<const double> weights) {
  MatrixD sums = MatrixD::Zero(as_index(clusters), rows.cols());
  std::vector<double> sizes(clusters);
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    const double weight = weight_of(weights, i);
    sums.row(cluster[i]) += weight * rows.row(as_index(i)).cast<double>();
    sizes[cluster[i]] += weight;
  }
  for (std::size_t m = 0; m < clusters; ++m) sums.row(as_index(m)) /= sizes[m];
  KMeans result{std::move(cluster), sums.cast<float>(), 0};
  const auto values = static_cast<std::size_t>(rows.cols());
  for (std::size_t i = 0; i < result.cluster.size(); ++i) {
    const float* const centre = result.centres.data() + result.cluster[i] * values;
    result.error += weight_of(weights, i) *
                    static_cast<double>(squared_distance(rows.data() + i * values, centre, values));
  }
  return result;
}

KMeans k_means(const Matrix& rows, std::size_t clusters, std::uint64_t seed,
               std::span<const double> weights) {
  KMeans best;
  for (std::uint64_t start = 0; start < kStarts; ++start) {
    KMeans found = k_means_once(rows, clusters, seed + start, weights);
    if (start == 0 || found.error < best.error) best = std::move(found);
  }
  return best;
}

}  // namespace btfc
