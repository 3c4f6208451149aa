// Radix 2, decimation in time (Cooley and Tukey 1965).
#include "format/fourier.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace btfc {

Fourier::Fourier(std::size_t n) : n_(n), reversed_(n), twiddle_(n / 2) {
  for (std::size_t i = 1; i < n; ++i) reversed_[i] = reversed_[i / 2] / 2 + (i % 2 == 1 ? n / 2 : 0);
  for (std::size_t k = 0; k < n / 2; ++k) {
    const double angle = -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n);
    twiddle_[k] = {std::cos(angle), std::sin(angle)};
  }
}

void Fourier::transform(std::span<std::complex<double>> f) const {
  for (std::size_t i = 0; i < n_; ++i) {
    if (i < reversed_[i]) std::swap(f[i], f[reversed_[i]]);
  }
  for (std::size_t half = 1; half < n_; half *= 2) {
    for (std::size_t begin = 0; begin < n_; begin += 2 * half) {
      for (std::size_t k = 0; k < half; ++k) {
        // Written out: std::complex checks every product for infinities.
        const std::complex<double> w = twiddle_[k * (n_ / 2 / half)], b = f[begin + half + k];
        const std::complex<double> odd(w.real() * b.real() - w.imag() * b.imag(),
                                       w.real() * b.imag() + w.imag() * b.real());
        f[begin + half + k] = f[begin + k] - odd;
        f[begin + k] += odd;
      }
    }
  }
}

void Fourier::transform_square(std::span<std::complex<double>> f) const {
  std::vector<std::complex<double>> column(n_);
  for (std::size_t y = 0; y < n_; ++y) transform(f.subspan(y * n_, n_));
  for (std::size_t x = 0; x < n_; ++x) {
    for (std::size_t y = 0; y < n_; ++y) column[y] = f[y * n_ + x];
    transform(column);
    for (std::size_t y = 0; y < n_; ++y) f[y * n_ + x] = column[y];
  }
}

}  // namespace btfc
