// Forward selection with the sweep operator.
#include "encoder/fields/neighbourhood_choice.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace btfc {
namespace {

constexpr double kSingular = 1e-9;  // of a candidate's own variance: the rest is rounding

// The moments of the planes' sum.
MatrixD summed(const NeighbourMoments& m) {
  const Eigen::Index n = kFieldCandidates + 1;
  MatrixD out = MatrixD::Zero(n, n);
  const auto planes = static_cast<Eigen::Index>(m.planes);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      out(i, j) = m.moments.block(i * planes, j * planes, planes, planes).sum();
  }
  return out;
}

// Takes candidate s out of all that is left to explain (Beaton 1964).
void sweep(MatrixD& a, Eigen::Index s) {
  const Eigen::VectorXd column = a.col(s);
  const double pivot = a(s, s);
  a.noalias() -= column * column.transpose() / pivot;
}

}  // namespace

std::uint64_t choose_neighbourhood(std::span<const NeighbourMoments> moments,
                                   std::optional<std::uint32_t> order, std::uint32_t most) {
  constexpr Eigen::Index kOwn = kFieldCandidates;
  std::vector<MatrixD> left;
  std::vector<Eigen::VectorXd> whole;
  for (const NeighbourMoments& m : moments) {
    left.push_back(summed(m));
    whole.push_back(left.back().diagonal());
  }
  std::uint64_t mask = 0;
  const std::uint32_t end = std::min(order.value_or(most), kFieldCandidates);
  for (std::uint32_t count = 0; count < end; ++count) {
    double best = 0;
    Eigen::Index chosen = -1;
    for (Eigen::Index s = 0; s < kOwn; ++s) {
      if ((mask >> s & 1) != 0) continue;
      double gain = 0;
      for (std::size_t k = 0; k < left.size(); ++k) {
        const MatrixD& a = left[k];
        if (a(s, s) <= kSingular * whole[k](s) || a(kOwn, kOwn) <= kSingular * whole[k](kOwn)) continue;
        const double explained = a(s, kOwn) * a(s, kOwn) / (a(s, s) * a(kOwn, kOwn));
        gain -= 0.5 * moments[k].samples * std::log1p(-std::min(explained, 1 - 1e-12));
        if (!order) gain -= 0.5 * std::log(moments[k].samples);
      }
      if (gain > best) {
        best = gain;
        chosen = s;
      }
    }
    if (chosen < 0) break;
    mask |= std::uint64_t{1} << chosen;
    for (std::size_t k = 0; k < left.size(); ++k) {
      if (left[k](chosen, chosen) > kSingular * whole[k](chosen)) sweep(left[k], chosen);
    }
  }
  // Where nothing is left to explain, the nearest ones fill up what was ordered.
  for (std::uint32_t n = 1; order && static_cast<std::uint32_t>(__builtin_popcountll(mask)) < end; ++n)
    mask |= nearest_candidates(n);
  return mask;
}

}  // namespace btfc
