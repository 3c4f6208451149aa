// Autocovariances, expanded.
#include "encoder/fields/band_moments.h"

#include <algorithm>
#include <array>

namespace btfc {
namespace {

constexpr int kLag = 8, kCoarseLag = 6;
constexpr double kLeastEigenvalue = 1e-6;

// r(dx, dy) = mean of a(x, y) b(x + dx, y + dy), -lag … lag both ways, their means taken off.
class Covariance {
 public:
  explicit Covariance(int lag)
      : lag_(lag), values_(static_cast<std::size_t>((2 * lag + 1) * (2 * lag + 1))) {}
  double& at(int dx, int dy) {
    return values_[static_cast<std::size_t>((dy + lag_) * (2 * lag_ + 1) + dx + lag_)];
  }
  double at(int dx, int dy) const {
    return values_[static_cast<std::size_t>((dy + lag_) * (2 * lag_ + 1) + dx + lag_)];
  }

 private:
  int lag_;
  std::vector<double> values_;
};

Covariance covariance(const FieldPlane& a, const FieldPlane& b, bool wraps) {
  const double mean_a = mean_of(a), mean_b = mean_of(b);
  const auto width = static_cast<int>(a.width), height = static_cast<int>(a.height);
  Covariance r(kCoarseLag);
  for (int dy = -kCoarseLag; dy <= kCoarseLag; ++dy) {
    for (int dx = -kCoarseLag; dx <= kCoarseLag; ++dx) {
      const bool torus = wraps || std::abs(dx) >= width || std::abs(dy) >= height;
      double sum = 0, count = 0;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          int u = x + dx, v = y + dy;
          if (torus) {
            u = (u % width + width) % width;
            v = (v % height + height) % height;
          } else if (u < 0 || u >= width || v < 0 || v >= height) {
            continue;
          }
          sum += (a.at(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) - mean_a) *
                 (b.at(static_cast<std::uint32_t>(u), static_cast<std::uint32_t>(v)) - mean_b);
          count += 1;
        }
      }
      r.at(dx, dy) = sum / count;
    }
  }
  return r;
}

// The autocorrelation of (1, 4, 6, 4, 1) / 8, halved for the mean over an axis' two phases.
constexpr std::array<double, 9> kKernel = [] {
  constexpr std::array<double, 5> kTaps = {1.0 / 8, 4.0 / 8, 6.0 / 8, 4.0 / 8, 1.0 / 8};
  std::array<double, 9> k{};
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t j = 0; j < 5; ++j) k[4 + i - j] += 0.5 * kTaps[i] * kTaps[j];
  }
  return k;
}();

Covariance expanded(const Covariance& coarse) {
  const auto weight = [](int lag) {
    return std::abs(lag) <= 4 ? kKernel[static_cast<std::size_t>(lag + 4)] : 0.0;
  };
  Covariance r(kLag);
  for (int dy = -kLag; dy <= kLag; ++dy) {
    for (int dx = -kLag; dx <= kLag; ++dx) {
      double sum = 0;
      for (int v = -kCoarseLag; v <= kCoarseLag; ++v) {
        for (int u = -kCoarseLag; u <= kCoarseLag; ++u)
          sum += weight(dx - 2 * u) * weight(dy - 2 * v) * coarse.at(u, v);
      }
      r.at(dx, dy) = sum;
    }
  }
  return r;
}

void keep_positive(MatrixD& m) {
  const Eigen::SelfAdjointEigenSolver<MatrixD> solver(m);
  const double floor = kLeastEigenvalue * std::max(0.0, m.trace()) / static_cast<double>(m.rows());
  if (solver.eigenvalues()(0) >= floor) return;
  m = solver.eigenvectors() * solver.eigenvalues().cwiseMax(floor).asDiagonal() *
      solver.eigenvectors().transpose();
}

}  // namespace

NeighbourMoments band_moments(std::span<const FieldPlane> fine, std::span<const FieldPlane> coarse,
                              Neighbourhood kind, bool wraps) {
  NeighbourMoments m = neighbour_moments(fine, kind, wraps);
  if (coarse.empty()) return m;
  // Offsets of row and column groups: of candidates one or two places, of the texel itself one.
  const auto places = [&](std::size_t s) {
    if (s == kFieldCandidates) return std::vector<FieldOffset>{{0, 0}};
    const FieldOffset o = field_offset(static_cast<std::uint32_t>(s));
    if (kind == Neighbourhood::causal) return std::vector<FieldOffset>{o};
    return std::vector<FieldOffset>{o, {-o.dx, -o.dy}};
  };
  for (std::size_t g = 0; g < fine.size(); ++g) {
    for (std::size_t h = 0; h < fine.size(); ++h) {
      const Covariance r = expanded(covariance(coarse[g], coarse[h], wraps));
      for (std::size_t s = 0; s <= kFieldCandidates; ++s) {
        for (std::size_t t = 0; t <= kFieldCandidates; ++t) {
          double sum = 0;
          for (const FieldOffset& a : places(s)) {
            for (const FieldOffset& b : places(t)) sum += r.at(b.dx - a.dx, b.dy - a.dy);
          }
          m.moments(m.at(s, g), m.at(t, h)) -= sum;
        }
      }
    }
  }
  m.moments = (0.5 * (m.moments + m.moments.transpose())).eval();
  keep_positive(m.moments);
  return m;
}

}  // namespace btfc
