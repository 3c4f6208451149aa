// Pairs -> runs of one view.
#include "encoder/dataset/view_pairs.h"

namespace btfc {

std::vector<ViewPairs> pairs_of_views(const DatasetInfo& info) {
  std::vector<ViewPairs> views(info.views.size());
  for (std::size_t pair = 0; pair < info.pairs.size(); ++pair) {
    ViewPairs& view = views[info.pairs[pair].view];
    if (view.count++ == 0) view.first = pair;
  }
  return views;
}

std::vector<Vector3> lights_of(const Directions& directions, const ViewPairs& view) {
  std::vector<Vector3> lights;
  for (std::size_t pair = view.first; pair < view.first + view.count; ++pair)
    lights.push_back(unit_vector(directions.lights[directions.pairs[pair].light]));
  return lights;
}

}  // namespace btfc
