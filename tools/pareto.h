// Which of some points no other one beats.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

namespace btfc {

// In both coordinates the smaller is the better.
struct ParetoPoint {
  double x = 0, y = 0;
};

// The points that no other one beats in both: numbers by rising x, of equal ones the first. Points without
// coordinates do not count.
std::vector<std::size_t> pareto_front(const std::vector<std::optional<ParetoPoint>>& points);

}  // namespace btfc
