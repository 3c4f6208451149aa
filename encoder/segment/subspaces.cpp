// Features of all images, k-means, and the clusters in order.
#include "encoder/segment/subspaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <span>

#include "encoder/for_each_index.h"
#include "encoder/segment/colour_histograms.h"
#include "encoder/segment/k_means.h"

namespace btfc {
namespace {

constexpr double kExplained = 0.9, kLeastMeanSquare = 0.05;
constexpr std::uint32_t kMostSubspaces = 65536;  // that an index of 16 bits tells apart

std::vector<float> features_of(const Dataset& dataset, const CodeTables& tables, std::size_t pair) {
  const DatasetInfo& info = dataset.info();
  std::vector<std::uint16_t> codes(info.image_samples());
  dataset.read_image(pair, codes);
  return colour_histograms(
      {codes, info.width, info.height, info.channel_count(), colour_meaning(info), &tables});
}

// A row a pair.
Matrix all_features(const Dataset& dataset,
                    const std::function<void(std::size_t done, std::size_t total)>& progress) {
  const CodeTables tables = code_tables(dataset.info().type, dataset.info().colour_space);
  const std::size_t pairs = dataset.info().pairs.size();
  Matrix rows(as_index(pairs), as_index(features_of(dataset, tables, 0).size()));
  const auto read = [&](std::size_t pair) -> Result<Done> {
    const std::vector<float> features = features_of(dataset, tables, pair);
    std::copy(features.begin(), features.end(), rows.row(as_index(pair)).data());
    return Done{};
  };
  static_cast<void>(for_each_index(pairs, read, progress));  // which cannot fail
  return rows;
}

// Rows that are equal have one number; numbers count the different ones from 0.
struct EqualRows {
  std::vector<std::size_t> number;
  std::size_t different = 0;
};

EqualRows equal_rows(const Matrix& rows) {
  const auto row = [&](std::size_t i) {
    return std::span(rows.row(as_index(i)).data(), static_cast<std::size_t>(rows.cols()));
  };
  EqualRows equal{std::vector<std::size_t>(static_cast<std::size_t>(rows.rows())), 0};
  std::vector<std::size_t> order(equal.number.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare(row(a).begin(), row(a).end(), row(b).begin(), row(b).end());
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool first =
        i == 0 || !std::equal(row(order[i]).begin(), row(order[i]).end(), row(order[i - 1]).begin());
    if (first) ++equal.different;
    equal.number[order[i]] = equal.different - 1;
  }
  return equal;
}

// At most as many clusters as there are different rows.
KMeans clusters_of(const Matrix& rows, std::span<const double> weights, const EqualRows& equal,
                   std::size_t clusters, std::uint64_t seed) {
  if (clusters < equal.different) return k_means(rows, clusters, seed, weights);
  return means_of(rows, std::vector<std::uint16_t>(equal.number.begin(), equal.number.end()), equal.different,
                  weights);
}

KMeans fewest_clusters(const Matrix& rows, std::span<const double> weights, const EqualRows& equal,
                       std::size_t most, std::uint64_t seed) {
  KMeans best = clusters_of(rows, weights, equal, 1, seed);
  const double enough =
      std::max((1 - kExplained) * best.error, kLeastMeanSquare * static_cast<double>(rows.rows()));
  // `few` are too few; `many` are enough, or the most there may be. Few clusters take less time than many.
  std::size_t few = 1, many = 1;
  while (best.error > enough && many < most) {
    few = many;
    many = std::min(2 * many, most);
    best = clusters_of(rows, weights, equal, many, seed);
  }
  while (many - few > 1) {
    const std::size_t between = (few + many) / 2;
    KMeans found = clusters_of(rows, weights, equal, between, seed);
    if (found.error > enough) {
      few = between;
    } else {
      many = between;
      best = std::move(found);
    }
  }
  return best;
}

std::vector<std::size_t> medoids(const Matrix& rows, const KMeans& found) {
  const auto clusters = static_cast<std::size_t>(found.centres.rows()),
             values = static_cast<std::size_t>(rows.cols());
  std::vector<std::size_t> medoid(clusters, found.cluster.size());
  std::vector<float> nearest(clusters);
  for (std::size_t i = 0; i < found.cluster.size(); ++i) {
    const std::size_t m = found.cluster[i];
    const float d = squared_distance(rows.data() + i * values, found.centres.data() + m * values, values);
    if (medoid[m] < found.cluster.size() && d >= nearest[m]) continue;
    medoid[m] = i;
    nearest[m] = d;
  }
  return medoid;
}

// By falling size, of equal sizes by medoid.
Subspaces in_order(const KMeans& found, const std::vector<std::size_t>& medoid) {
  std::vector<std::size_t> size(medoid.size()), order(medoid.size()), place(medoid.size());
  for (const std::uint16_t m : found.cluster) ++size[m];
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return size[a] != size[b] ? size[a] > size[b] : medoid[a] < medoid[b];
  });
  Subspaces result;
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = i;
    result.medoid.push_back(medoid[order[i]]);
  }
  for (const std::uint16_t m : found.cluster) result.of_pair.push_back(static_cast<std::uint16_t>(place[m]));
  return result;
}

}  // namespace

Result<Subspaces> segment_pairs(const Dataset& dataset, std::uint32_t clusters, std::uint64_t seed,
                                const std::function<void(std::size_t, std::size_t)>& progress) {
  if (clusters > kMostSubspaces) {
    return bad_argument(
        fmt::format("{} clusters of images are asked for, expected at most {}", clusters, kMostSubspaces));
  }
  const Matrix rows = all_features(dataset, progress);
  const EqualRows equal = equal_rows(rows);
  const std::size_t most =
      std::min<std::size_t>(clusters > 0 ? clusters : kMostAutomaticSubspaces, equal.different);
  const std::vector<double>& weights = dataset.info().weights;
  const KMeans found = clusters > 0 ? clusters_of(rows, weights, equal, most, seed)
                                    : fewest_clusters(rows, weights, equal, most, seed);
  Subspaces result = in_order(found, medoids(rows, found));
  const double spread = means_of(rows, std::vector<std::uint16_t>(found.cluster.size()), 1, weights).error;
  result.explained = spread > 0 ? std::max(0.0, 1 - found.error / spread) : 1;
  return result;
}

}  // namespace btfc
