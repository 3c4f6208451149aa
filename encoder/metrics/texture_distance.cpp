// Three crops, the features of each, and distances between them.
#include "encoder/metrics/texture_distance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "encoder/metrics/autocorrelation.h"
#include "encoder/metrics/colour_marginals.h"
#include "encoder/metrics/display_values.h"
#include "encoder/metrics/stsim.h"
#include "encoder/metrics/texture_statistics.h"

namespace btfc {
namespace {

static_assert(kLeastTextureCrop >= kLeastStsimSide);

// A square of `side` texels in the middle of a part of an image.
Image middle(const Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
             std::uint32_t side) {
  return crop(image, x + (width - side) / 2, y + (height - side) / 2, side, side);
}

struct Features {
  Spectrum spectrum;
  std::vector<double> autocorrelation;
  StsimFeatures stsim;
};

Features features_of(const Image& image) {
  const std::vector<double> values = luma(image, display_table(image));
  const std::uint32_t side = image.width;
  return {texture_statistics(image, spectrum_block(side, side)).spectrum, autocorrelation(values, side),
          stsim_features(values, side)};
}

}  // namespace

Result<TextureDistances> texture_distances(const Image& reference, const Image& candidate) {
  if (reference.channels != candidate.channels) {
    return bad_argument(
        fmt::format("the textures differ in channels: {} and {}", reference.channels, candidate.channels));
  }
  const bool across = reference.width >= reference.height;
  const std::uint32_t half_width = across ? reference.width / 2 : reference.width;
  const std::uint32_t half_height = across ? reference.height : reference.height / 2;
  const std::uint32_t fits = std::min({half_width, half_height, candidate.width, candidate.height});
  if (fits < kLeastTextureCrop) {
    return bad_argument(
        fmt::format("halves of a reference of {}x{} texels and a candidate of {}x{}, expected "
                    "squares of {}x{} in each",
                    reference.width, reference.height, candidate.width, candidate.height, kLeastTextureCrop,
                    kLeastTextureCrop));
  }
  TextureDistances out;
  out.crop = kLeastTextureCrop;
  while (2 * out.crop <= std::min(fits, kMostTextureCrop)) out.crop *= 2;
  const std::uint32_t x = reference.width - half_width, y = reference.height - half_height;
  const std::array<Image, 2> halves = {middle(reference, 0, 0, half_width, half_height, out.crop),
                                       middle(reference, x, y, half_width, half_height, out.crop)};
  const Image other = middle(candidate, 0, 0, candidate.width, candidate.height, out.crop);
  const Features a = features_of(halves[0]), b = features_of(halves[1]), c = features_of(other);

  const auto measured = [&](const auto& distance) -> AgainstCeiling {
    return {(distance(a, c) + distance(b, c)) / 2, distance(a, b)};
  };
  out.spectrum = measured(
      [](const Features& p, const Features& q) { return spectrum_distance(p.spectrum, q.spectrum); });
  out.autocorrelation = measured([](const Features& p, const Features& q) {
    return autocorrelation_distance(p.autocorrelation, q.autocorrelation);
  });
  out.stsim2 = measured([](const Features& p, const Features& q) { return stsim2(p.stsim, q.stsim); });

  const ColourAxes axes = colour_axes(halves);
  const auto ac = marginal_distances(axes, halves[0], other), bc = marginal_distances(axes, halves[1], other),
             ab = marginal_distances(axes, halves[0], halves[1]);
  const auto count = static_cast<double>(ab.size());
  for (std::size_t i = 0; i < ab.size(); ++i) {
    out.marginal.push_back({(ac[i] + bc[i]) / 2, ab[i]});
    out.marginals.value += out.marginal[i].value / count;
    out.marginals.ceiling += out.marginal[i].ceiling / count;
  }
  return out;
}

}  // namespace btfc
