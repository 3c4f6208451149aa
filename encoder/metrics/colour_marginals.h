// Distributions of a texture's colours along axes that do not correlate.
#pragma once
#include <span>
#include <vector>

#include "encoder/image.h"

namespace btfc {

// The Karhunen-Loeve transform of some images' display-coded channels, all texels alike.
struct ColourAxes {
  std::vector<std::vector<double>> axes;  // orthonormal, by falling variance; one a channel
  std::vector<double> deviations;         // along them, at least a step of 8 bits, 1 / 255
};

// The images have the same number of channels.
ColourAxes colour_axes(std::span<const Image> images);

// Per axis the texels' places along it, in its deviations, sorted.
using ColourMarginals = std::vector<std::vector<double>>;

ColourMarginals colour_marginals(const ColourAxes& axes, const Image& image);

// Per axis the Wasserstein-1 distance between the distributions of two images: the mean absolute difference
// of their sorted values. Both have the same axes and the same number of texels.
std::vector<double> marginal_distances(const ColourMarginals& a, const ColourMarginals& b);

}  // namespace btfc
