// Measures between pictures of one material that need not be aligned nor equal in size.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "encoder/image.h"

namespace btfc {

// The power of a picture's luma at each frequency, by Welch's method: blocks of `block` x `block` texels half
// a block apart (further apart where more than 32 a side would fit), Hann window, mean removed, averaged. The
// power is that per texel: white noise of variance s^2 has s^2 everywhere.
struct Spectrum {
  std::uint32_t block = 0;    // a power of two
  std::vector<double> power;  // block x block, frequency (0, 0) first
};

// The largest power of two that is at most 64 and at most either side.
std::uint32_t spectrum_block(std::uint32_t width, std::uint32_t height);

// What is compared. Values are display-coded, as in ImageMetrics.
struct TextureStatistics {
  // Mean of |L(x+1, y) - L(x, y)| and |L(x, y+1) - L(x, y)| over all neighbours, L the luma; 0 of one texel.
  double gradient = 0;
  Spectrum spectrum;
  // Per channel: the share of texels at each of 256 values, rounded to 8 bits, and the standard deviation.
  std::vector<std::array<double, 256>> histograms;
  std::vector<double> deviations;
};

// block: of the spectrum; equal in statistics that are to be compared, and at most spectrum_block of each.
TextureStatistics texture_statistics(const Image& image, std::uint32_t block);

// The ratio of two mean gradients (display-coded luma, 0 … 1), each with 10^-6 added, a 4000th of a step of 8
// bits: defined for constant pictures, 1 for equal ones.
double gradient_ratio(double numerator, double denominator);

// gradient_ratio of candidate to reference: 1 as sharp, below 1 blurred, above 1 seams or noise.
double gradient_kept(const TextureStatistics& reference, const TextureStatistics& candidate);

// sum over frequencies f != 0 of |ln((P_c(f) + q) / (P_r(f) + q))| / |f|, divided by the sum of 1 / |f|, with
// q = 1 / (12 * 255^2), the power of rounding to 8 bits. 0 for equal spectra, ln 2 = 0.69 where every
// frequency has twice or half the power. The weight 1 / |f| makes rings of frequencies count alike, so that
// coarse structure is not outvoted by the many fine frequencies.
double spectrum_distance(const Spectrum& reference, const Spectrum& candidate);

// The Wasserstein-1 distance between the histograms of a channel in standard deviations of the reference's
// channel (at least a step of 8 bits), averaged over channels, of which both have the same number.
double colour_distance(const TextureStatistics& reference, const TextureStatistics& candidate);

// Where a texture's patches join. A pair of neighbours counts as a join where its bit is set.
struct JoinMask {
  static constexpr std::uint8_t kRight = 1;  // (x, y) and (x + 1, y)
  static constexpr std::uint8_t kBelow = 2;  // (x, y) and (x, y + 1)
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> bits;  // a byte a texel, rows from the top
};

// Mean absolute differences of luma between neighbours at joins and between all other neighbours.
struct JoinGradients {
  double joins = 0, interior = 0;
  std::uint64_t join_pairs = 0, interior_pairs = 0;

  // gradient_ratio of joins to interior: 1 where joins cannot be told from the rest, above 1 where they show,
  // below 1 where they are blurred. Nothing where there are no joins or no interior.
  std::optional<double> seam_ratio() const;
};

// The mask has the image's size.
JoinGradients join_gradients(const Image& image, const JoinMask& mask);

}  // namespace btfc
