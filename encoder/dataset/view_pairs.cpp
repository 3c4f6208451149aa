// Pairs -> runs of one view.
#include "encoder/dataset/view_pairs.h"

#include <algorithm>
#include <functional>
#include <numeric>

namespace btfc {

std::vector<ViewPairs> pairs_of_views(const DatasetInfo& info) {
  std::vector<ViewPairs> views(info.views.size());
  for (std::size_t pair = 0; pair < info.pairs.size(); ++pair) {
    ViewPairs& view = views[info.pairs[pair].view];
    if (view.count++ == 0) view.first = pair;
  }
  return views;
}

std::vector<double> weights_of(const DatasetInfo& info, const ViewPairs& view) {
  if (info.weights.empty()) return {};
  const auto first = info.weights.begin() + static_cast<std::ptrdiff_t>(view.first);
  std::vector<double> weights(first, first + static_cast<std::ptrdiff_t>(view.count));
  if (std::adjacent_find(weights.begin(), weights.end(), std::not_equal_to<>()) == weights.end()) return {};
  const double mean =
      std::accumulate(weights.begin(), weights.end(), 0.0) / static_cast<double>(weights.size());
  for (double& weight : weights) weight /= mean;
  return weights;
}

std::vector<Vector3> lights_of(const Directions& directions, const ViewPairs& view) {
  std::vector<Vector3> lights;
  for (std::size_t pair = view.first; pair < view.first + view.count; ++pair)
    lights.push_back(unit_vector(directions.lights[directions.pairs[pair].light]));
  return lights;
}

}  // namespace btfc
