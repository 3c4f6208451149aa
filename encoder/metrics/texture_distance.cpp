// Crops, the features of each, and distances between them.
#include "encoder/metrics/texture_distance.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "encoder/metrics/autocorrelation.h"
#include "encoder/metrics/colour_marginals.h"
#include "encoder/metrics/display_values.h"
#include "encoder/metrics/stsim.h"
#include "encoder/metrics/texture_statistics.h"

namespace btfc {
namespace {

static_assert(kLeastTextureCrop >= kLeastStsimSide);

// Squares of `side` texels in the middles of an image's parts, rows from the top.
std::vector<Image> crops_of(const Image& image, std::uint32_t side) {
  const std::uint32_t across = std::min(2u, image.width / side), down = std::min(2u, image.height / side);
  const auto place = [&](std::uint32_t part, std::uint32_t parts, std::uint32_t length) {
    return (part * length / parts + (part + 1) * length / parts - side) / 2;
  };
  std::vector<Image> crops;
  for (std::uint32_t j = 0; j < down; ++j) {
    for (std::uint32_t i = 0; i < across; ++i)
      crops.push_back(crop(image, place(i, across, image.width), place(j, down, image.height), side, side));
  }
  return crops;
}

struct Features {
  Image crop;
  Spectrum spectrum;
  std::vector<double> autocorrelation;
  StsimFeatures stsim;
};

std::vector<Features> features_of(const std::vector<Image>& crops) {
  std::vector<Features> out;
  for (const Image& image : crops) {
    const std::vector<double> values = luma(image, display_table(image));
    const std::uint32_t side = image.width;
    out.push_back({image, texture_statistics(image, spectrum_block(side, side)).spectrum,
                   autocorrelation(values, side), stsim_features(values, side)});
  }
  return out;
}

// Spectrum, autocorrelation, STSIM-2, and the marginals.
std::vector<double> distances(const ColourAxes& axes, const Features& p, const Features& q) {
  std::vector<double> out = {spectrum_distance(p.spectrum, q.spectrum),
                             autocorrelation_distance(p.autocorrelation, q.autocorrelation),
                             stsim2(p.stsim, q.stsim)};
  for (const double d : marginal_distances(axes, p.crop, q.crop)) out.push_back(d);
  return out;
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
  const std::vector<Image> own_crops = crops_of(reference, out.crop);
  const ColourAxes axes = colour_axes(own_crops);
  const std::vector<Features> own = features_of(own_crops),
                              others = features_of(crops_of(candidate, out.crop));
  const auto count = static_cast<double>(axes.axes.size()), own_count = static_cast<double>(own.size()),
             pairs = own_count * static_cast<double>(others.size());
  std::vector<AgainstCeiling> mean(3 + axes.axes.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    for (const Features& other : others) {
      const std::vector<double> d = distances(axes, own[i], other);
      for (std::size_t m = 0; m < mean.size(); ++m) mean[m].value += d[m] / pairs;
    }
    for (std::size_t j = 0; j < i; ++j) {
      const std::vector<double> d = distances(axes, own[j], own[i]);
      for (std::size_t m = 0; m < mean.size(); ++m)
        mean[m].ceiling += d[m] / (own_count * (own_count - 1) / 2);
    }
  }
  out.spectrum = mean[0];
  out.autocorrelation = mean[1];
  out.stsim2 = mean[2];
  out.marginal.assign(mean.begin() + 3, mean.end());
  for (const AgainstCeiling& m : out.marginal) {
    out.marginals.value += m.value / count;
    out.marginals.ceiling += m.ceiling / count;
  }
  return out;
}

}  // namespace btfc
