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

// The unit vector of a direction as a file records it.
Vector3 unit_vector(const DirectionPoint& point);
// Of the lights of one view's pairs.
std::vector<Vector3> lights_of(const Directions& directions, const ViewPairs& view);

}  // namespace btfc
