// Sums over planes.
#include "encoder/fields/plane.h"

#include <numeric>

namespace btfc {

double mean_of(const FieldPlane& plane) {
  return std::accumulate(plane.values.begin(), plane.values.end(), 0.0) /
         static_cast<double>(plane.values.size());
}

}  // namespace btfc
