// Ranks and quantiles.
#include "encoder/fields/marginal.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "shaders/models/field.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <unsupported/Eigen/SpecialFunctions>
#pragma GCC diagnostic pop

namespace btfc {

FieldPlane normal_scores(const FieldPlane& plane) {
  const std::size_t n = plane.values.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return plane.values[a] < plane.values[b] || (plane.values[a] == plane.values[b] && a < b);
  });
  FieldPlane scores = plane;
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    while (end < n && plane.values[order[end]] == plane.values[order[begin]]) ++end;
    const double rank = 0.5 * static_cast<double>(begin + end);
    const double score = end - begin == n ? 0.0 : Eigen::numext::ndtri(rank / static_cast<double>(n));
    for (; begin < end; ++begin) scores.values[order[begin]] = score;
  }
  return scores;
}

std::vector<float> marginal_table(const FieldPlane& plane, std::uint32_t knots) {
  std::vector<double> sorted = plane.values;
  std::sort(sorted.begin(), sorted.end());
  std::vector<float> table;
  for (std::uint32_t i = 0; i < knots; ++i) {
    const double score = double{FIELD_TABLE_END} * (2.0 * i / (knots - 1) - 1);
    const double share = 0.5 * std::erfc(-score / std::sqrt(2.0));
    const double at = std::clamp(share * static_cast<double>(sorted.size()) - 0.5, 0.0,
                                 static_cast<double>(sorted.size() - 1));
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    table.push_back(static_cast<float>(sorted[below] +
                                       (at - static_cast<double>(below)) * (sorted[above] - sorted[below])));
  }
  return table;
}

double steepest(const std::vector<float>& table) {
  double most = 0;
  for (std::size_t i = 1; i < table.size(); ++i)
    most = std::max(most, std::fabs(double{table[i]} - double{table[i - 1]}));
  return most * static_cast<double>(table.size() - 1) / (2 * double{FIELD_TABLE_END});
}

}  // namespace btfc
