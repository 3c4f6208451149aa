// Wiener and Khinchin: the transform of the power of the image beside zeros, so that it does not wrap.
#include "encoder/metrics/autocorrelation.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "format/fourier.h"

namespace btfc {

std::vector<double> autocorrelation(std::span<const double> values, std::size_t side) {
  const std::size_t padded = 2 * side;
  double mean = 0;
  for (const double v : values) mean += v;
  mean /= static_cast<double>(values.size());
  std::vector<std::complex<double>> f(padded * padded);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) f[y * padded + x] = values[y * side + x] - mean;
  }
  const Fourier fourier(padded);
  fourier.transform_square(f);
  for (auto& c : f) c = std::norm(c);
  fourier.transform_square(f);  // the power is even: forward is inverse but for the scale
  const auto sum_at = [&](std::ptrdiff_t dx, std::size_t dy) {
    const std::size_t x = dx < 0 ? padded - static_cast<std::size_t>(-dx) : static_cast<std::size_t>(dx);
    return f[dy * padded + x].real() / static_cast<double>(padded * padded);
  };
  const double variance = sum_at(0, 0) / static_cast<double>(values.size());
  const auto lags = static_cast<std::ptrdiff_t>(std::min(kMostLag, side / 2));
  std::vector<double> out;
  for (std::ptrdiff_t dy = 0; dy <= lags; ++dy) {
    for (std::ptrdiff_t dx = dy == 0 ? 1 : -lags; dx <= lags; ++dx) {
      const auto n = static_cast<std::ptrdiff_t>(side);
      const auto pairs = static_cast<double>((n - std::abs(dx)) * (n - dy));
      out.push_back(sum_at(dx, static_cast<std::size_t>(dy)) / pairs / (variance + 1 / (12.0 * 255 * 255)));
    }
  }
  return out;
}

double autocorrelation_distance(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace btfc
