// k-means++ and its repair.
#include "encoder/linear/row_clusters.h"

#include <algorithm>
#include <limits>

namespace btfc {

std::vector<std::size_t> spread_rows(const Matrix& rows, std::size_t count,
                                     const std::function<double()>& uniform,
                                     std::span<const double> weights) {
  const auto candidates = static_cast<std::size_t>(rows.rows());
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  std::vector<double> distance(candidates, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> drawn;
  double all = 0;
  for (std::size_t i = 0; i < candidates; ++i) all += weight(i);
  std::size_t next = 0;
  for (double left = uniform() * all; next + 1 < candidates && left >= weight(next); ++next)
    left -= weight(next);
  while (drawn.size() < count) {
    drawn.push_back(next);
    const Eigen::RowVectorXf centre = rows.row(as_index(next));
    double total = 0;
    for (std::size_t i = 0; i < candidates; ++i) {
      const double d = static_cast<double>((rows.row(as_index(i)) - centre).squaredNorm());
      distance[i] = std::min(distance[i], d);
      total += weight(i) * distance[i];
    }
    double left = uniform() * total;
    for (next = 0; next + 1 < candidates && left >= weight(next) * distance[next]; ++next)
      left -= weight(next) * distance[next];
  }
  return drawn;
}

void fill_empty(RowClusters& found, std::size_t clusters) {
  std::vector<std::size_t> sizes(clusters);
  for (const std::uint16_t m : found.cluster) ++sizes[m];
  for (std::size_t m = 0; m < clusters; ++m) {
    if (sizes[m] > 0) continue;
    std::size_t worst = found.cluster.size();
    for (std::size_t i = 0; i < found.cluster.size(); ++i) {
      if (sizes[found.cluster[i]] > 1 &&
          (worst == found.cluster.size() || found.error[i] > found.error[worst]))
        worst = i;
    }
    --sizes[found.cluster[worst]];
    found.cluster[worst] = static_cast<std::uint16_t>(m);
    found.error[worst] = 0;
    sizes[m] = 1;
  }
}

}  // namespace btfc
