// Sums over planes.
#include "encoder/fields/plane.h"

#include <algorithm>
#include <numeric>

namespace btfc {

// In blocks: the rounding of one running sum grows with its length.
double mean_of(const FieldPlane& plane) {
  constexpr std::ptrdiff_t kBlock = 1 << 14;
  double sum = 0;
  for (auto at = plane.values.begin(); at != plane.values.end();) {
    const auto end = at + std::min(kBlock, plane.values.end() - at);
    sum += std::accumulate(at, end, 0.0);
    at = end;
  }
  return sum / static_cast<double>(plane.values.size());
}

}  // namespace btfc
