// Moments of pyramid bands.
#include "encoder/metrics/stsim.h"

#include <cmath>

#include "encoder/metrics/steerable_pyramid.h"

namespace btfc {
namespace {

constexpr double kC = 1 / (12.0 * 255 * 255);

// Calls visit(index of the coefficient) for rows and columns [margin, side - margin - less).
template <class Visit>
double for_interior(std::size_t side, std::size_t less_x, std::size_t less_y, const Visit& visit) {
  const std::size_t margin = side / 8;
  double count = 0;
  for (std::size_t y = margin; y < side - margin - less_y; ++y) {
    for (std::size_t x = margin; x < side - margin - less_x; ++x) {
      visit(y * side + x);
      ++count;
    }
  }
  return count;
}

StsimFeatures::Band band_features(const PyramidBand& band) {
  const auto& v = band.values;
  std::complex<double> mean = 0;
  double power = 0;
  const double count = for_interior(band.side, 0, 0, [&](std::size_t q) { mean += v[q]; });
  mean /= count;
  for_interior(band.side, 0, 0, [&](std::size_t q) { power += std::norm(v[q] - mean); });
  power /= count;
  const auto correlation = [&](std::size_t dx, std::size_t dy) {
    std::complex<double> sum = 0;
    const double pairs = for_interior(band.side, dx, dy, [&](std::size_t q) {
      sum += (v[q] - mean) * std::conj(v[q + dy * band.side + dx] - mean);
    });
    return sum / (pairs * (power + kC));
  };
  return {std::abs(mean), std::sqrt(power), correlation(1, 0), correlation(0, 1)};
}

// Of |coarse| with |fine| at the same places: each coefficient, or each second one where fine is one scale
// finer.
double cross_correlation(const PyramidBand& fine, const PyramidBand& coarse) {
  const std::size_t step = fine.side / coarse.side;
  const auto at = [&](std::size_t q) {
    return std::abs(fine.values[q / coarse.side * step * fine.side + q % coarse.side * step]);
  };
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  const double count = for_interior(coarse.side, 0, 0, [&](std::size_t q) {
    const double x = at(q), y = std::abs(coarse.values[q]);
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  });
  const double va = std::fmax(0, aa / count - a * a / (count * count)),
               vb = std::fmax(0, bb / count - b * b / (count * count));
  return (ab / count - a * b / (count * count)) / (std::sqrt(va * vb) + kC);
}

double agreement(double a, double b) { return (2 * a * b + kC) / (a * a + b * b + kC); }

}  // namespace

StsimFeatures stsim_features(std::span<const double> luma, std::size_t side) {
  const SteerablePyramid pyramid = steerable_pyramid(luma, side);
  StsimFeatures out;
  out.bands.push_back(band_features(pyramid.high));
  for (std::size_t s = 0; s < SteerablePyramid::kScales; ++s) {
    const auto& scale = pyramid.oriented[s];
    for (std::size_t k = 0; k < scale.size(); ++k) {
      out.bands.push_back(band_features(scale[k]));
      for (std::size_t l = k + 1; l < scale.size(); ++l) {
        out.cross_correlations.push_back(cross_correlation(scale[k], scale[l]));
      }
      if (s > 0) out.cross_correlations.push_back(cross_correlation(pyramid.oriented[s - 1][k], scale[k]));
    }
  }
  out.bands.push_back(band_features(pyramid.low));
  return out;
}

double stsim2(const StsimFeatures& a, const StsimFeatures& b) {
  double sum = 0;
  for (std::size_t m = 0; m < a.bands.size(); ++m) {
    const StsimFeatures::Band &p = a.bands[m], &q = b.bands[m];
    const double product = agreement(p.mean, q.mean) * agreement(p.deviation, q.deviation) *
                           (1 - std::abs(p.right - q.right) / 2) * (1 - std::abs(p.below - q.below) / 2);
    sum += std::pow(product, 0.25);
  }
  for (std::size_t i = 0; i < a.cross_correlations.size(); ++i) {
    sum += 1 - std::fabs(a.cross_correlations[i] - b.cross_correlations[i]) / 2;
  }
  return sum / static_cast<double>(a.bands.size() + a.cross_correlations.size());
}

}  // namespace btfc
