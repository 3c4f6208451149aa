// A Fourier transform for spectra of small blocks.
#pragma once
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace btfc {

// F(k) = sum over t of f(t) exp(-2 pi i k t / n), in place, for one n = 1, 2, 4, …
class Fourier {
 public:
  explicit Fourier(std::size_t n);
  std::size_t size() const { return n_; }
  void transform(std::span<std::complex<double>> values) const;
  // Rows, then columns, of n x n values in rows.
  void transform_square(std::span<std::complex<double>> values) const;

 private:
  std::size_t n_;
  std::vector<std::size_t> reversed_;          // the bits of 0 … n-1 in reverse order
  std::vector<std::complex<double>> twiddle_;  // for h = 1, 2, … n / 2: exp(-pi i k / h), k < h
};

}  // namespace btfc
