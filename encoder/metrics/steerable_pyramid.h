// The complex steerable pyramid: an image split into scales and orientations.
#pragma once
#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace btfc {

// side x side coefficients in rows.
struct PyramidBand {
  std::size_t side = 0;
  std::vector<std::complex<double>> values;
};

// Simoncelli and Freeman 1995, filters of Portilla and Simoncelli 2000, applied to the spectrum;
// the image repeats. Bands of scale s have side / 2^s coefficients a side, the low-pass residue side / 8.
// Orientation k is that of frequencies around k pi / 4; only that half of the plane is kept, so that
// |coefficient| is the local amplitude. The filters' squares sum to 1: mean |high|^2 + mean |low|^2 + 2 sum
// mean |oriented|^2 = mean value^2.
struct SteerablePyramid {
  static constexpr std::size_t kScales = 3, kOrientations = 4;
  PyramidBand high, low;  // real
  std::array<std::array<PyramidBand, kOrientations>, kScales> oriented;
};

// side x side values, side a power of two and at least 8.
SteerablePyramid steerable_pyramid(std::span<const double> values, std::size_t side);

}  // namespace btfc
