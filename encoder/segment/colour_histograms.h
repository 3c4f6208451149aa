// How an image's colours are distributed: cumulative histograms as features whose distance is one between
// distributions.
#pragma once
#include <cstddef>
#include <vector>

#include "encoder/metrics/code_view.h"

namespace btfc {

inline constexpr std::size_t kHistogramBins = 32;
inline constexpr std::size_t kMostHistogramTexels = 16384;

// For each axis and each of kHistogramBins equal bins of its range, the mean over the bin of the share F(v)
// of texels with at most the value v, times the root of the bin's width w. Means over bins keep shifts that
// are smaller than a bin, and for two images with no spread the sum of w |F - F'| is the transport distance,
// the difference of their values. The squared Euclidean distance of two features is the Cramér distance, the
// integral of (F - F')^2 dv, summed over axes and in units of the axes.
//
// Axes: of RGB L* over 0 … 100, a* and b* over -110 … 110 (CIE 1976, of display-coded values as lab.h has
// them); of grey L* alone; of images without a colour meaning each channel, 0 … 1 counted as 0 … 100, their
// distances averaged, so that they weigh as L* does. Values are clipped at 1 as in all measures.
//
// From a grid of texels with an equal step each way, the smallest that keeps to kMostHistogramTexels.
std::vector<float> colour_histograms(const CodeView& image);

}  // namespace btfc
