// Pixel-aligned measures between two data sets: over all pairs of directions, over steep and grazing views,
// and view by view.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/metrics/image_metrics.h"
#include "format/result.h"

namespace btfc {

// Views up to this angle from the normal are steep, the others grazing: means over all hide what fails at
// grazing views. By the view alone, as the curves over views of Filip and Haindl 2009 (figure 10) are.
inline constexpr double kSteepDegrees = 45;

// A pair's PSNR counts as at most this in mean and percentile, so that equal images stay finite.
inline constexpr double kMostPsnrDb = 100;

// Over a set of pairs, each counted by the reference's DatasetInfo::weights but for peak_8bit and the
// percentiles. All are NaN where there are no pairs; single ones where ImageMetrics has them NaN.
struct GroupMetrics {
  std::uint64_t pairs = 0;
  // Pooled: from the squared error over all texels, channels and pairs. Infinite PSNR where all are equal.
  double psnr_db = 0, rmse_8bit = 0, peak_8bit = 0;
  double mean_psnr_db = 0;                 // the mean of the pairs' PSNR, each at most kMostPsnrDb
  double ssim = 0, mae_lab = 0, flip = 0;  // means over pairs
  // Of what the texels of an image have in common, for models that do not keep them in place: the error of
  // the mean BRDF (root of the mean square over pairs and channels), and the mean over pairs of the distance
  // of colours (the root of the distance of colour_histograms, segment/colour_histograms.h; with mae_lab).
  double brdf_rmse_8bit = 0, colours = 0;
  double psnr_db_p5 = 0, ssim_p5 = 0;    // the worst twentieth of the pairs begins here: 5th percentiles,
  double mae_lab_p95 = 0, flip_p95 = 0;  // and 95th; linear between ranks
};

struct ViewMetrics {
  Direction view;
  std::uint64_t pairs = 0;
  double psnr_db = 0;                      // pooled; infinite where all are equal
  double ssim = 0, mae_lab = 0, flip = 0;  // means over pairs
};

struct DatasetMetrics {
  GroupMetrics all, steep, grazing;
  std::vector<ViewMetrics> views;                    // those that have pairs, in the data sets' order
  std::uint64_t differing_samples = 0, samples = 0;  // as in ImageMetrics
};

struct DatasetMetricOptions {
  MetricOptions measures;
  std::function<void(std::size_t done, std::size_t total)> progress;  // from one thread at a time
};

// Values as in ImageMetrics. SSIM is that of luma where the channels are R, G, B (colour_meaning), else that
// of the mean of all channels; mae_lab and flip need RGB or one channel. Sample types and colour spaces may
// differ; size, number of channels, directions (same_direction, in the same order) and pairs must not, and
// the first difference is named. The reference's channel names count. Pairs are compared in parallel on the
// threads of the calling oneTBB arena, each in single precision but for sums; sums over pairs are taken in
// order, so that the result does not depend on the threads. Holds two images a thread and a record a pair.
Result<DatasetMetrics> compare_datasets(const Dataset& reference, const Dataset& candidate,
                                        const DatasetMetricOptions& options = {});

}  // namespace btfc
