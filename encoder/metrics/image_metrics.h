// Pixel-aligned measures between two images.
#pragma once
#include <cstdint>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

// Values are display-coded and clamped to [0, 1] before all measures: integer codes as they are, float16
// through the sRGB curve unless the map holds data. Not rounded to 8 bits. Alpha counts as a channel.
struct ImageMetrics {
  double psnr_db = 0;                   // peak 1; infinite for equal images
  double rmse_8bit = 0;                 // root mean squared difference x 255
  double peak_8bit = 0;                 // largest absolute difference x 255
  double ssim = 0;                      // Wang et al. 2004 on luma; NaN where a side is below 11 texels
  double mae_lab = 0, de76 = 0;         // lab_difference, NaN where channels are no colours (colour_meaning)
  double flip = 0;                      // mean of flip_by_rows, 0 … 1; NaN as for mae_lab
  std::uint64_t differing_samples = 0;  // codes that are not equal; all of them where the types differ
  std::uint64_t samples = 0;
};

// Measures that cost time; those that are off are NaN.
struct MetricOptions {
  bool ssim = true, mae_lab = true, flip = true;
};

// Both images must have the same size and number of channels. a is the reference, though all measures are
// symmetric. Thread-safe.
Result<ImageMetrics> compare_images(const Image& a, const Image& b, const MetricOptions& options = {});

}  // namespace btfc
