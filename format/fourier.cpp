// Radix 2, decimation in time (Cooley and Tukey 1965).
#include "format/fourier.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace btfc {

namespace {

// Columns that are transformed beside one another, so that what a row's cache lines hold is all used.
constexpr std::size_t kColumns = 8;

}  // namespace

Fourier::Fourier(std::size_t n) : n_(n), reversed_(n) {
  for (std::size_t i = 1; i < n; ++i) reversed_[i] = reversed_[i / 2] / 2 + (i % 2 == 1 ? n / 2 : 0);
  for (std::size_t half = 1; half < n; half *= 2) {
    for (std::size_t k = 0; k < half; ++k) {
      const double angle =
          -2 * std::numbers::pi * static_cast<double>(k * (n / 2 / half)) / static_cast<double>(n);
      twiddle_.emplace_back(std::cos(angle), std::sin(angle));
    }
  }
}

void Fourier::transform(std::span<std::complex<double>> f) const {
  for (std::size_t i = 0; i < n_; ++i) {
    if (i < reversed_[i]) std::swap(f[i], f[reversed_[i]]);
  }
  for (std::size_t half = 1; half < n_; half *= 2) {
    const std::complex<double>* w = &twiddle_[half - 1];
    for (std::size_t begin = 0; begin < n_; begin += 2 * half) {
      std::complex<double>*low = &f[begin], *high = low + half;
      for (std::size_t k = 0; k < half; ++k) {
        // Written out: std::complex checks every product for infinities.
        const double re = w[k].real() * high[k].real() - w[k].imag() * high[k].imag();
        const double im = w[k].real() * high[k].imag() + w[k].imag() * high[k].real();
        const std::complex<double> odd(re, im);
        high[k] = low[k] - odd;
        low[k] += odd;
      }
    }
  }
}

void Fourier::transform_square(std::span<std::complex<double>> f) const {
  for (std::size_t y = 0; y < n_; ++y) transform(f.subspan(y * n_, n_));
  const std::size_t across = std::min(kColumns, n_);
  std::vector<std::complex<double>> columns(across * n_);
  for (std::size_t x = 0; x < n_; x += across) {
    for (std::size_t y = 0; y < n_; ++y) {
      for (std::size_t i = 0; i < across; ++i) columns[i * n_ + y] = f[y * n_ + x + i];
    }
    for (std::size_t i = 0; i < across; ++i) transform(std::span(columns).subspan(i * n_, n_));
    for (std::size_t y = 0; y < n_; ++y) {
      for (std::size_t i = 0; i < across; ++i) f[y * n_ + x + i] = columns[i * n_ + y];
    }
  }
}

}  // namespace btfc
