// Lambert's law by least squares: plain, trimmed, re-weighted.
#include "encoder/range/photometric_stereo.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "encoder/linear/matrix.h"

namespace btfc {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kLeastEigenvalue = 1e-3;  // of the largest
constexpr double kLeastCosine = 0.02;
constexpr double kLeastNz = 1e-4;

constexpr std::size_t kLeastVoters = 6;  // lights: half of them outnumber three that are fitted exactly
constexpr double kDark = 0.1;            // of the brightest: shadowed, where too few lights can vote

// Shares of the darkest and brightest lights that a trimmed fit leaves out; steep texels in the shadow of
// walls see a quarter of the lights.
struct Trim {
  double dark, bright;
};
constexpr Trim kTrims[] = {{0.3, 0.2}, {0.5, 0}, {0.5, 0.2}, {0.7, 0.05}, {0.1, 0.4}, {0.1, 0.1}, {0, 0}};

constexpr int kStartRounds = 2, kRounds = 6;
constexpr double kSpreadOfMedian = 0.6745;  // median |r| of normal noise, in standard deviations
constexpr double kLeastSpread = 0.005;      // of the albedo: below are rounding and the lights' own errors
constexpr double kStartCut = 4.685;         // Tukey's, in spreads: 95 % efficient under normal noise
constexpr double kCutDarker = 3, kCutBrighter = 2;

// The lights that count, and one texel's values under them.
struct Samples {
  std::vector<Vector> lights;
  std::vector<double> values;
};

// The b with the least sum of weight (b.l - I)^2; none where the lights do not determine it.
class NormalEquations {
 public:
  void add(const Vector& light, double value, double weight) {
    gram_.noalias() += weight * light * light.transpose();
    right_ += weight * value * light;
    ++count_;
  }
  std::optional<Vector> solve() const {
    if (count_ < 3) return std::nullopt;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(gram_, Eigen::EigenvaluesOnly);
    const auto& values = eigen.eigenvalues();  // ascending
    if (!(values[0] > kLeastEigenvalue * values[2])) return std::nullopt;
    return Vector(gram_.ldlt().solve(right_));
  }

 private:
  Eigen::Matrix3d gram_ = Eigen::Matrix3d::Zero();
  Vector right_ = Vector::Zero();
  std::size_t count_ = 0;
};

// Of the lights for which take(i).
template <class Take>
std::optional<Vector> fit_where(const Samples& s, const Take& take) {
  NormalEquations equations;
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    if (take(i)) equations.add(s.lights[i], s.values[i], 1);
  }
  return equations.solve();
}

std::optional<Vector> fit_all(const Samples& s) {
  return fit_where(s, [](std::size_t) { return true; });
}

// The lower median; the list is not empty and ends in another order.
double median_of(std::vector<double>& list) {
  const auto middle = list.begin() + static_cast<std::ptrdiff_t>((list.size() - 1) / 2);
  std::nth_element(list.begin(), middle, list.end());
  return *middle;
}

// Fits robustly; keeps its lists from texel to texel.
class RobustFit {
 public:
  std::optional<Vector> operator()(const Samples& s) {
    if (s.lights.size() < kLeastVoters) {
      const double floor = kDark * *std::max_element(s.values.begin(), s.values.end());
      const auto bright = fit_where(s, [&](std::size_t i) { return s.values[i] > floor; });
      return bright ? bright : fit_all(s);
    }
    rank_lights(s);
    std::optional<Vector> best;
    double best_score = 0;
    for (const Trim& trim : kTrims) {
      const auto start = fit_ranked(s, trim);
      if (!start) continue;
      const Vector b = reweighted(s, *start, kStartRounds, kStartCut, kStartCut);
      const double score = median_residual(s, b);
      if (best && !(score < best_score)) continue;
      best = b;
      best_score = score;
    }
    if (!best) return std::nullopt;
    return reweighted(s, *best, kRounds, kCutDarker, kCutBrighter);
  }

 private:
  // From dark to bright; of equal ones the first light first.
  void rank_lights(const Samples& s) {
    order_.resize(s.lights.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = i;
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return s.values[a] != s.values[b] ? s.values[a] < s.values[b] : a < b;
    });
    bright_ = s.values[order_[order_.size() * 4 / 5]];
  }

  std::optional<Vector> fit_ranked(const Samples& s, const Trim& trim) const {
    const auto n = static_cast<double>(order_.size());
    const auto begin = static_cast<std::size_t>(trim.dark * n);
    const std::size_t end = order_.size() - static_cast<std::size_t>(trim.bright * n);
    NormalEquations equations;
    for (std::size_t k = begin; k < end; ++k) equations.add(s.lights[order_[k]], s.values[order_[k]], 1);
    return equations.solve();
  }

  // Of lights that are neither dark nor predicted so: else a black texel would explain every shadow.
  double median_residual(const Samples& s, const Vector& b) {
    list_.clear();
    for (std::size_t i = 0; i < s.lights.size(); ++i) {
      const double predicted = std::max(b.dot(s.lights[i]), 0.0);
      if (std::max(predicted, s.values[i]) >= kDark * bright_)
        list_.push_back(std::abs(s.values[i] - predicted));
    }
    return list_.empty() ? 0 : median_of(list_);
  }

  Vector reweighted(const Samples& s, Vector b, int rounds, double cut_darker, double cut_brighter) {
    const std::size_t n = s.lights.size();
    for (int round = 0; round < rounds; ++round) {
      residual_.resize(n);
      facing_.resize(n);
      list_.clear();
      for (std::size_t i = 0; i < n; ++i) {
        const double predicted = b.dot(s.lights[i]);
        facing_[i] = predicted > 0;
        residual_[i] = s.values[i] - predicted;
        if (facing_[i]) list_.push_back(std::abs(residual_[i]));
      }
      if (list_.empty()) return b;
      const double spread = std::max(median_of(list_) / kSpreadOfMedian, kLeastSpread * b.norm());
      NormalEquations equations;
      for (std::size_t i = 0; i < n; ++i) {
        const double cut = (residual_[i] < 0 ? cut_darker : cut_brighter) * spread;
        if (!facing_[i] || !(std::abs(residual_[i]) < cut)) continue;
        const double u = residual_[i] / cut;
        equations.add(s.lights[i], s.values[i], (1 - u * u) * (1 - u * u));
      }
      const auto next = equations.solve();
      if (!next) return b;
      const double change = (*next - b).norm();
      b = *next;
      if (change <= 1e-6 * b.norm()) return b;
    }
    return b;
  }

  std::vector<std::size_t> order_;
  std::vector<double> residual_, list_;
  std::vector<char> facing_;
  double bright_ = 0;  // the value at four fifths of the ranks
};

bool in_sight(const std::optional<Vector>& b) { return b && b->allFinite() && b->z() > 0; }

TexelSurface surface_of(const Vector& b) {
  const double albedo = b.norm();
  Vector n = b / albedo;
  n.z() = std::max(n.z(), kLeastNz);
  n.normalize();
  return {{static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())},
          static_cast<float>(albedo),
          true};
}

TexelSurface level_surface(const Samples& s) {
  double product = 0, square = 0;
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    product += s.lights[i].z() * s.values[i];
    square += s.lights[i].z() * s.lights[i].z();
  }
  TexelSurface level;
  if (square > 0) level.albedo = static_cast<float>(std::max(product / square, 0.0));
  return level;
}

}  // namespace

std::vector<TexelSurface> photometric_stereo(std::span<const Vector3> lights,
                                             std::span<const float> intensities, std::size_t texels,
                                             const StereoOptions& options) {
  std::vector<std::size_t> from;
  Samples samples;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!options.cosine_included && !(lights[i][2] >= kLeastCosine)) continue;
    from.push_back(i);
    samples.lights.emplace_back(lights[i][0], lights[i][1], lights[i][2]);
  }
  samples.values.resize(from.size());
  std::vector<TexelSurface> out(texels);
  if (from.empty()) return out;
  const bool determined = fit_all(samples).has_value();
  RobustFit robust;
  for (std::size_t t = 0; t < texels; ++t) {
    double brightest = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const auto value = static_cast<double>(intensities[from[i] * texels + t]);
      samples.values[i] = options.cosine_included ? value : value * samples.lights[i].z();
      brightest = std::max(brightest, samples.values[i]);
    }
    std::optional<Vector> b;
    if (determined && brightest > 0) {
      if (options.method == StereoMethod::robust) b = robust(samples);
      if (!in_sight(b)) b = fit_all(samples);
    }
    out[t] = in_sight(b) ? surface_of(*b) : level_surface(samples);
  }
  return out;
}

}  // namespace btfc
