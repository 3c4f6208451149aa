// Filters are products of a function of radius and one of angle; a scale is half as fine by keeping the
// middle of the spectrum, outside which its filters are 0.
#include "encoder/metrics/steerable_pyramid.h"

#include <cmath>
#include <numbers>

#include "format/fourier.h"

namespace btfc {
namespace {

constexpr double kPi = std::numbers::pi;
// 2^(K-1) (K-1)! / sqrt(K (2 (K-1))!) for K = 4 orientations: squares over orientations sum to 1.
const double kAngular = 48 / std::sqrt(2880.0);

// Of amplitude 1 up to pi/4 and 0 from pi/2; high is its complement in power.
double low_pass(double r) {
  if (r <= kPi / 4) return 1;
  return r >= kPi / 2 ? 0 : std::cos(kPi / 2 * std::log2(4 * r / kPi));
}
double high_pass(double r) {
  if (r <= kPi / 4) return 0;
  return r >= kPi / 2 ? 1 : std::cos(kPi / 2 * std::log2(2 * r / kPi));
}

double oriented(double angle, std::size_t orientation) {
  const double c = std::cos(angle - kPi * static_cast<double>(orientation) / SteerablePyramid::kOrientations);
  return c > 0 ? kAngular * c * c * c : 0;
}

// The coefficients of spectrum * filter(r, angle) on a grid of `side` points a side; r in radians per texel.
template <class Filter>
PyramidBand band(const std::vector<std::complex<double>>& spectrum, std::size_t full, std::size_t side,
                 const Filter& filter) {
  PyramidBand out{side, std::vector<std::complex<double>>(side * side)};
  const auto frequency = [&](std::size_t i) {  // -side/2 … side/2 - 1
    return static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(i < (side + 1) / 2 ? 0 : side);
  };
  const double step = 2 * kPi / static_cast<double>(full);
  for (std::size_t j = 0; j < side; ++j) {
    for (std::size_t i = 0; i < side; ++i) {
      const std::ptrdiff_t u = frequency(i), v = frequency(j);
      const std::size_t from =
          (v < 0 ? full - static_cast<std::size_t>(-v) : static_cast<std::size_t>(v)) * full +
          (u < 0 ? full - static_cast<std::size_t>(-u) : static_cast<std::size_t>(u));
      const double x = step * static_cast<double>(u), y = step * static_cast<double>(v);
      // Conjugated before and after, the forward transform is the inverse one.
      out.values[j * side + i] = std::conj(spectrum[from]) * filter(std::hypot(x, y), std::atan2(y, x));
    }
  }
  Fourier(side).transform_square(out.values);
  const double scale = 1 / (static_cast<double>(full) * static_cast<double>(full));
  for (auto& c : out.values) c = std::conj(c) * scale;
  return out;
}

}  // namespace

SteerablePyramid steerable_pyramid(std::span<const double> values, std::size_t side) {
  std::vector<std::complex<double>> spectrum(values.begin(), values.end());
  Fourier(side).transform_square(spectrum);
  SteerablePyramid out;
  out.high = band(spectrum, side, side, [](double r, double) { return high_pass(r / 2); });
  // What the scales before leave of radius r.
  const auto left = [](double r, std::size_t scale) {
    double product = low_pass(r / 2);
    for (std::size_t s = 0; s < scale; ++s) product *= low_pass(std::ldexp(r, static_cast<int>(s)));
    return product;
  };
  for (std::size_t s = 0; s < SteerablePyramid::kScales; ++s) {
    for (std::size_t k = 0; k < SteerablePyramid::kOrientations; ++k) {
      out.oriented[s][k] = band(spectrum, side, side >> s, [&](double r, double angle) {
        return left(r, s) * high_pass(std::ldexp(r, static_cast<int>(s))) * oriented(angle, k);
      });
    }
  }
  out.low = band(spectrum, side, side >> SteerablePyramid::kScales,
                 [&](double r, double) { return left(r, SteerablePyramid::kScales); });
  return out;
}

}  // namespace btfc
