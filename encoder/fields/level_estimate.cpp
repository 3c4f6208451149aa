// Estimates from moments, and their repair.
#include "encoder/fields/level_estimate.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "encoder/fields/recursion_stability.h"
#include "format/models/field_response.h"
#include "format/models/field_torus.h"

namespace btfc {
namespace {

constexpr double kPrior = 1e-6;
// Sums of many noises are all but normal: six standard deviations are passed once in 500 million.
constexpr double kDeviations = 6;
constexpr double kClear = 0.5;
constexpr double kMostRadius = 0.9999;
// Of gmrf's spectrum: where an estimate has to be repaired its peak, at the longest waves, would otherwise
// hold most of the variance, and windows differ in colour.
constexpr double kLeastDenominator = 1e-3;
constexpr int kBisections = 14;

std::vector<FieldOffset> offsets_of(std::uint64_t mask) {
  std::vector<FieldOffset> offsets;
  for (std::uint32_t s = 0; s < kFieldCandidates; ++s) {
    if ((mask >> s & 1) != 0) offsets.push_back(field_offset(s));
  }
  return offsets;
}

// Rows and columns of the moments that a neighbourhood uses.
std::vector<Eigen::Index> used_rows(const NeighbourMoments& m, std::uint64_t mask) {
  std::vector<Eigen::Index> rows;
  for (std::uint32_t s = 0; s < kFieldCandidates; ++s) {
    for (std::size_t g = 0; g < m.planes && (mask >> s & 1) != 0; ++g) rows.push_back(m.at(s, g));
  }
  return rows;
}

float round_to(double value, Precision precision) {
  return rounded(static_cast<float>(value), precision, {});
}

// Largest rho <= 1 that is good; good(0) holds.
template <class Good>
double largest_good(const Good& good) {
  if (good(1.0)) return 1;
  double low = 0, high = 1;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (good(middle) ? low : high) = middle;
  }
  return low;
}

double likelihood_lost(double samples, double before, double after, std::size_t planes) {
  if (!(before > 0) || !(after > before)) return 0;
  return 0.5 * samples * static_cast<double>(planes) * std::log(after / before);
}

// One level's recursion with given coefficients: its noise, and how far it reaches.
struct Settled {
  std::vector<float> numbers;
  std::vector<double> tail;        // by margin: a bound on the error of values
  std::uint32_t least_margin = 4;  // from which on rule FD6 is kept, well clear of its limits
  double radius = 0;
  bool good = false;
};

Settled settle(const NeighbourMoments& moments, std::uint64_t mask, const std::vector<FieldOffset>& offsets,
               const std::vector<double>& coefficients, const LevelDemand& demand) {
  const std::size_t d = moments.planes;
  Settled s;
  std::vector<double> rounded_coefficients;
  for (const double a : coefficients) {
    rounded_coefficients.push_back(double{round_to(a, demand.precision)});
    if (!std::isfinite(rounded_coefficients.back())) return s;
  }
  s.radius = recursion_radius(offsets, rounded_coefficients, d);
  if (!(s.radius < kMostRadius)) return s;

  FieldShape shape;
  shape.kind = d > 1 ? FieldKind::car3d : FieldKind::car;
  shape.factors = static_cast<std::uint32_t>(d);
  shape.levels = demand.level + 1;
  shape.margins[demand.level] = kMostFittedMargin;
  shape.masks.assign(shape.levels, mask);
  // The noise's factor: of the identity first, to see what variance comes of it.
  MatrixD factor = MatrixD::Identity(as_index(d), as_index(d));
  if (d > 1) {
    const MatrixD residual = residual_covariance(moments, mask, rounded_coefficients);
    const double floor = 1e-9 * residual.trace() / static_cast<double>(d) + 1e-30;
    factor = Eigen::LLT<MatrixD>(residual + floor * MatrixD::Identity(as_index(d), as_index(d))).matrixL();
  }
  const auto write = [&](double scale) {
    std::vector<float> numbers;
    if (d == 1) {
      numbers.push_back(round_to(scale, demand.precision));
    } else {
      for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t j = 0; j <= i; ++j)
          numbers.push_back(round_to(scale * factor(as_index(i), as_index(j)), demand.precision));
      }
    }
    for (const double a : rounded_coefficients) numbers.push_back(static_cast<float>(a));
    return numbers;
  };
  s.numbers = write(1);
  const FieldBand band = field_band(shape, demand.level, s.numbers.data());
  // Responses to each output's unit impulse; noise e reaches output f through sum over g of h(f, g) L(g, e).
  std::vector<FieldDecay> decays;
  for (std::uint32_t g = 0; g < d; ++g) decays.push_back(field_decay(band, 0, g));
  double variance = 0;
  if (d == 1) {
    variance = std::accumulate(decays[0].energy.begin(), decays[0].energy.end(), 0.0);
  } else {
    const std::size_t plane = (kMostFittedMargin + 1) * (2 * kMostFittedMargin + 1);
    std::vector<float> h(d * d * plane);
    FieldBand whole = band;
    if (!field_responses(whole, 0, h.data())) return s;
    for (const float v : h) variance += double{v} * double{v};
  }
  const double wanted = std::accumulate(demand.variance.begin(), demand.variance.end(), 0.0);
  const double scale = variance > 0 && wanted > 0 ? std::sqrt(wanted / variance) : 0;
  s.numbers = write(scale);
  // The variance of what lies beyond a margin; beyond the window what the last rings' fall says.
  s.tail.assign(kMostFittedMargin + 1, 0);
  for (std::uint32_t g = 0; g < d; ++g) {
    const std::vector<double>& energy = decays[g].energy;
    const std::ptrdiff_t n = std::ssize(energy);
    const double last = std::accumulate(energy.end() - 16, energy.end(), 0.0);
    const double before = std::accumulate(energy.end() - 32, energy.end() - 16, 0.0);
    // Where next to nothing is left, what the rings still hold is the rounding of the least numbers.
    const bool reaches = last > 1e-24 * std::accumulate(energy.begin(), energy.end(), 0.0);
    if (reaches && !(last < before)) return s;
    double outside = reaches ? last * last / (before - last) : 0;
    // Of d outputs whose parts add up.
    const double noise = static_cast<double>(d) * scale * scale * factor.row(as_index(g)).squaredNorm();
    const double weight = *std::max_element(demand.weight.begin(), demand.weight.end());
    for (std::ptrdiff_t m = n; m-- > 0;) {
      s.tail[static_cast<std::size_t>(m)] += weight * weight * noise * outside;
      outside += energy[static_cast<std::size_t>(m)];
    }
    const std::vector<double>& rings = decays[g].rings;
    const auto beyond = [&](std::uint32_t m) {
      return (1 + decays[g].coefficients) * (rings[m] + rings[m - 1] + rings[m - 2] + rings[m - 3]);
    };
    std::uint32_t margin = kMostFittedMargin;
    while (margin > 4 && beyond(margin - 1) < kClear * kMostBeyond) --margin;
    s.least_margin = std::max(s.least_margin, margin);
    if (decays[g].whole() > kClear * kMostResponse || beyond(margin) > kClear * kMostBeyond) return s;
  }
  for (double& v : s.tail) v = kDeviations * std::sqrt(v);
  s.good = s.tail[kMostFittedMargin] <= demand.error;
  return s;
}

}  // namespace

std::vector<double> estimate_coefficients(const NeighbourMoments& m, std::uint64_t mask) {
  const std::vector<Eigen::Index> rows = used_rows(m, mask);
  const auto n = as_index(rows.size()), d = as_index(m.planes);
  std::vector<double> out(rows.size() * m.planes);
  double variance = 0;
  for (std::size_t g = 0; g < m.planes; ++g) variance += m.moments(m.own(g), m.own(g));
  if (n == 0 || !(variance > 0)) return out;
  MatrixD v(n, n), xy(n, d);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j) v(i, j) = m.moments(row, rows[static_cast<std::size_t>(j)]);
    v(i, i) += kPrior * variance / static_cast<double>(d);
    for (Eigen::Index f = 0; f < d; ++f) xy(i, f) = m.moments(row, m.own(static_cast<std::size_t>(f)));
  }
  const MatrixD solved = Eigen::LDLT<MatrixD>(v).solve(xy);
  // (neighbour, from) x to -> neighbour, to, from.
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto s = static_cast<std::size_t>(i) / m.planes, g = static_cast<std::size_t>(i) % m.planes;
    for (Eigen::Index f = 0; f < d; ++f)
      out[(s * m.planes + static_cast<std::size_t>(f)) * m.planes + g] = solved(i, f);
  }
  return out;
}

MatrixD residual_covariance(const NeighbourMoments& m, std::uint64_t mask,
                            const std::vector<double>& coefficients) {
  const std::vector<Eigen::Index> rows = used_rows(m, mask);
  const auto n = as_index(rows.size()), d = as_index(m.planes);
  // (I, -A) times the moments of (y, x) times its transpose.
  MatrixD select = MatrixD::Zero(d, n + d), v(n + d, n + d);
  std::vector<Eigen::Index> all = rows;
  for (std::size_t g = 0; g < m.planes; ++g) all.push_back(m.own(g));
  for (Eigen::Index i = 0; i < n + d; ++i) {
    for (Eigen::Index j = 0; j < n + d; ++j)
      v(i, j) = m.moments(all[static_cast<std::size_t>(i)], all[static_cast<std::size_t>(j)]);
  }
  for (Eigen::Index f = 0; f < d; ++f) {
    select(f, n + f) = 1;
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto s = static_cast<std::size_t>(i) / m.planes, g = static_cast<std::size_t>(i) % m.planes;
      select(f, i) = -coefficients[(s * m.planes + static_cast<std::size_t>(f)) * m.planes + g];
    }
  }
  return select * v * select.transpose();
}

double prediction_error(const NeighbourMoments& m, std::uint64_t mask,
                        const std::vector<double>& coefficients) {
  return std::max(0.0, residual_covariance(m, mask, coefficients).trace() / static_cast<double>(m.planes));
}

RecursiveEstimate::RecursiveEstimate(std::size_t neighbours, double prior)
    : inverse_(MatrixD::Identity(as_index(neighbours), as_index(neighbours)) / prior),
      coefficients_(Eigen::VectorXd::Zero(as_index(neighbours))) {}

void RecursiveEstimate::add(const Eigen::VectorXd& neighbours, double value) {
  const Eigen::VectorXd gain = inverse_ * neighbours;
  const double scale = 1 + neighbours.dot(gain), wrong = value - coefficients_.dot(neighbours);
  coefficients_ += gain * (wrong / scale);
  inverse_ -= gain * gain.transpose() / scale;
  lambda_ += wrong * wrong / scale;
  count_ += 1;
}

LevelModel settle_recursion(const NeighbourMoments& moments, std::uint64_t mask, const LevelDemand& demand) {
  const std::size_t d = moments.planes;
  const std::vector<FieldOffset> offsets = offsets_of(mask);
  const std::vector<double> raw = estimate_coefficients(moments, mask);
  LevelModel model;
  model.radius = recursion_radius(offsets, raw, d);
  model.shrink = largest_good(
      [&](double rho) { return settle(moments, mask, offsets, shrunk(offsets, raw, d, rho), demand).good; });
  const std::vector<double> kept = shrunk(offsets, raw, d, model.shrink);
  Settled s = settle(moments, mask, offsets, kept, demand);
  model.repaired_radius = s.radius;
  model.numbers = std::move(s.numbers);
  model.tail = std::move(s.tail);
  model.margin = s.least_margin;
  while (model.margin < kMostFittedMargin && model.tail[model.margin] > demand.error) ++model.margin;
  model.likelihood_lost = likelihood_lost(moments.samples, prediction_error(moments, mask, raw),
                                          prediction_error(moments, mask, kept), d);
  return model;
}

LevelModel settle_markov(const NeighbourMoments& moments, std::uint64_t mask, std::uint32_t side,
                         const LevelDemand& demand) {
  const std::vector<FieldOffset> offsets = offsets_of(mask);
  const std::vector<double> raw = estimate_coefficients(moments, mask);
  std::vector<double> denominator(std::size_t{side} * side);
  const auto round_all = [&](double rho) {
    std::vector<float> a;
    for (const double v : raw) a.push_back(round_to(rho * v, demand.precision));
    field_torus_denominator(offsets, a.data(), side, denominator);
    return a;
  };
  LevelModel model;
  const auto least = [&] { return *std::min_element(denominator.begin(), denominator.end()); };
  round_all(1);
  model.radius = 1 - least();
  model.shrink = largest_good([&](double rho) {
    round_all(rho);
    return least() >= kLeastDenominator;
  });
  const std::vector<float> a = round_all(model.shrink);
  model.repaired_radius = 1 - least();
  double variance = 0;
  for (std::size_t i = 1; i < denominator.size(); ++i) variance += 1 / denominator[i];
  variance /= static_cast<double>(denominator.size());
  const double wanted = demand.variance[0];
  const double spread = variance > 0 && wanted > 0 ? std::sqrt(wanted / variance) : 0;
  model.numbers = {round_to(spread, demand.precision)};
  model.numbers.insert(model.numbers.end(), a.begin(), a.end());
  model.margin = 0;
  std::vector<double> kept = raw;
  for (double& v : kept) v *= model.shrink;
  model.likelihood_lost = likelihood_lost(moments.samples, prediction_error(moments, mask, raw),
                                          prediction_error(moments, mask, kept), 1);
  return model;
}

}  // namespace btfc
