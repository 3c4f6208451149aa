// A data set's pairs view by view: where they stand, and where their lights are.
#pragma once
#include <vector>

#include "encoder/dataset/dataset.h"
#include "format/directions.h"

namespace btfc {

// A view's pairs stand one after another.
struct ViewPairs {
  std::size_t first = 0, count = 0;
};
std::vector<ViewPairs> pairs_of_views(const DatasetInfo& info);

// The weights of one view's pairs among themselves, with mean 1; none where they are all alike.
std::vector<double> weights_of(const DatasetInfo& info, const ViewPairs& view);

// The unit vectors of the lights of one view's pairs, as a file records them.
std::vector<Vector3> lights_of(const Directions& directions, const ViewPairs& view);

}  // namespace btfc
