// STSIM-2: structural similarity of textures that are not aligned.
#pragma once
#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace btfc {

// What is compared: statistics of the bands of a steerable pyramid over the whole image but a border of an
// eighth on each side, where the repeated image shows.
struct StsimFeatures {
  struct Band {
    double mean = 0, deviation = 0;             // |mean|, and the root of the mean |x - mean|^2
    std::complex<double> right = 0, below = 0;  // correlation of coefficients with their neighbours
  };
  std::vector<Band> bands;  // high, 3 scales x 4 orientations, low
  std::vector<double>
      cross_correlations;  // of |x| between orientations of a scale and between adjacent scales
};

inline constexpr std::size_t kLeastStsimSide = 16;

// side x side values of luma, 0 … 1; side a power of two, at least kLeastStsimSide.
StsimFeatures stsim_features(std::span<const double> luma, std::size_t side);

// STSIM-2 of Zujovic, Pappas and Neuhoff, "Structural Texture Similarity Metrics for Image Analysis and
// Retrieval", IEEE Trans. Image Processing 22(7), 2013, with global windows. Of a band with means m,
// deviations s and neighbour correlations r of both images,
//   l = (2 m m' + C) / (m^2 + m'^2 + C), c = (2 s s' + C) / (s^2 + s'^2 + C), c01 = 1 - |r01 - r01'| / 2, c10
// alike, and q = (l c c01 c10)^(1/4); of two bands with cross correlations r, 1 - |r - r'| / 2. The result is
// the mean over 14 bands and 18 + 8 pairs of bands: 1 for equal features, above 0 otherwise. C = 1 / (12 *
// 255^2), the power of rounding to 8 bits; correlations have it added to their denominators.
double stsim2(const StsimFeatures& a, const StsimFeatures& b);

}  // namespace btfc
