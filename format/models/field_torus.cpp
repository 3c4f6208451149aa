// Fourier transforms of power-of-two tori.
#include "format/models/field_torus.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

namespace btfc {
namespace {

constexpr double kLeastDenominator = 5.9604644775390625e-08;  // 2^-24

// exp(2 pi i k / n) for all k.
std::vector<std::complex<double>> roots(std::size_t n) {
  std::vector<std::complex<double>> w(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n);
    w[k] = {std::cos(angle), std::sin(angle)};
  }
  return w;
}

// Radix 2, in place: sum over t of f(t) exp(-+ 2 pi i k t / n), not divided by n.
void transform(std::complex<double>* f, std::size_t n, std::size_t stride, bool inverse,
               const std::vector<std::complex<double>>& w) {
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; (j & bit) != 0; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(f[i * stride], f[j * stride]);
  }
  for (std::size_t half = 1; half < n; half *= 2) {
    for (std::size_t begin = 0; begin < n; begin += 2 * half) {
      for (std::size_t k = 0; k < half; ++k) {
        const std::complex<double> root = w[k * (n / 2 / half)];
        const double re = root.real(), im = inverse ? root.imag() : -root.imag();
        std::complex<double>&a = f[(begin + k) * stride], &b = f[(begin + half + k) * stride];
        const std::complex<double> odd(re * b.real() - im * b.imag(), re * b.imag() + im * b.real());
        b = a - odd;
        a += odd;
      }
    }
  }
}

void transform_square(std::vector<std::complex<double>>& f, std::size_t n, bool inverse) {
  const auto w = roots(n);
  for (std::size_t y = 0; y < n; ++y) transform(&f[y * n], n, 1, inverse, w);
  for (std::size_t x = 0; x < n; ++x) transform(&f[x], n, n, inverse, w);
}

}  // namespace

void field_torus_denominator(std::span<const FieldOffset> offsets, const float* coefficients,
                             std::uint32_t side, std::span<double> out) {
  const auto w = roots(side);
  for (std::uint32_t i = 0; i < side; ++i) {
    for (std::uint32_t j = 0; j < side; ++j) {
      double sum = 1;
      for (std::size_t s = 0; s < offsets.size(); ++s) {
        const auto phase =
            static_cast<std::uint32_t>(offsets[s].dx) * j + static_cast<std::uint32_t>(offsets[s].dy) * i;
        sum -= 2 * double{coefficients[s]} * w[phase & (side - 1)].real();
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
  transform_square(f, n, false);
  const double scale = double{numbers[0]} / static_cast<double>(texels);
  // No mean: a torus is all there is of the texture, and its colour is the mean's.
  f[0] = 0;
  for (std::size_t i = 0; i < texels; ++i) f[i] *= scale / std::sqrt(denominator[i]);
  transform_square(f, n, true);
  for (std::size_t i = 0; i < texels; ++i) out[i] = static_cast<float>(f[i].real());
  return Done{};
}

}  // namespace btfc
