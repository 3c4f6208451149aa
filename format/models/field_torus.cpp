// Fourier transforms of power-of-two tori.
#include "format/models/field_torus.h"

#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "format/fourier.h"

namespace btfc {
namespace {

constexpr double kLeastDenominator = 5.9604644775390625e-08;  // 2^-24

}  // namespace

void field_torus_denominator(std::span<const FieldOffset> offsets, const float* coefficients,
                             std::uint32_t side, std::span<double> out) {
  std::vector<double> cosine(side);
  for (std::size_t k = 0; k < side; ++k)
    cosine[k] = std::cos(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(side));
  for (std::uint32_t i = 0; i < side; ++i) {
    for (std::uint32_t j = 0; j < side; ++j) {
      double sum = 1;
      for (std::size_t s = 0; s < offsets.size(); ++s) {
        const auto phase =
            static_cast<std::uint32_t>(offsets[s].dx) * j + static_cast<std::uint32_t>(offsets[s].dy) * i;
        sum -= 2 * double{coefficients[s]} * cosine[phase & (side - 1)];
      }
      out[std::size_t{i} * side + j] = sum;
    }
  }
}

Result<Done> field_torus(const FieldBand& band, std::uint32_t subspace, std::uint32_t factor,
                         std::uint32_t side, float* out) {
  const float* numbers = band.numbers + std::size_t{subspace} * band.record + band.begins[factor];
  const std::size_t n = side, texels = n * n;
  std::vector<double> denominator(texels);
  field_torus_denominator(band.neighbours(factor), numbers + 1, side, denominator);
  for (const double v : denominator) {
    if (v >= kLeastDenominator) continue;
    return invalid(
        "FD6", 0,
        fmt::format("the spectrum of subspace {}, factor {}, level {} is not positive: 1 - 2 sum a cos "
                    "is {:.4g}, expected at least 2^-24",
                    subspace, factor, band.level, v));
  }
  std::vector<std::complex<double>> f(texels);
  const uint stream = field_stream(band.seed, band.level, factor);
  for (std::size_t i = 0; i < texels; ++i) {
    const auto x = static_cast<uint>(i % n), y = static_cast<uint>(i / n);
    f[i] = static_cast<double>(field_noise_integer(x, y, stream)) * double{FIELD_NOISE_UNIT};
  }
  const Fourier fourier(n);
  fourier.transform_square(f);
  const double scale = double{numbers[0]} / static_cast<double>(texels);
  // No mean: a torus is all there is of the texture, and its colour is the mean's. The inverse transform is
  // the conjugate of the forward one of the conjugate; what it gives is real.
  f[0] = 0;
  for (std::size_t i = 0; i < texels; ++i) f[i] = std::conj(f[i]) * (scale / std::sqrt(denominator[i]));
  fourier.transform_square(f);
  for (std::size_t i = 0; i < texels; ++i) out[i] = static_cast<float>(f[i].real());
  return Done{};
}

}  // namespace btfc
