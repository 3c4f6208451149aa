// One pass over the points by x.
#include "tools/pareto.h"

#include <algorithm>
#include <utility>

namespace btfc {

std::vector<std::size_t> pareto_front(const std::vector<std::optional<ParetoPoint>>& points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i]) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(points[a]->x, points[a]->y) < std::pair(points[b]->x, points[b]->y);
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order) {
    if (front.empty() || points[i]->y < points[front.back()]->y) front.push_back(i);
  }
  return front;
}

}  // namespace btfc
