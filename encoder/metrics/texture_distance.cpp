// Crops, the features of each, and distances between them.
#include "encoder/metrics/texture_distance.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>
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
  ColourMarginals marginals;
  Spectrum spectrum;
  std::vector<double> autocorrelation;
  StsimFeatures stsim;
};

std::vector<Features> features_of(const ColourAxes& axes, const std::vector<Image>& crops) {
  std::vector<Features> out(crops.size());
  tbb::parallel_for(std::size_t{0}, crops.size(), [&](std::size_t i) {
    const Image& image = crops[i];
    const std::vector<double> values = luma(image, display_table(image));
    const std::uint32_t side = image.width;
    out[i] = {colour_marginals(axes, image), texture_statistics(image, spectrum_block(side, side)).spectrum,
              autocorrelation(values, side), stsim_features(values, side)};
  });
  return out;
}

// Spectrum, autocorrelation, STSIM-2, and the marginals.
std::vector<double> distances_of(const Features& p, const Features& q) {
  std::vector<double> out = {spectrum_distance(p.spectrum, q.spectrum),
                             autocorrelation_distance(p.autocorrelation, q.autocorrelation),
                             stsim2(p.stsim, q.stsim)};
  for (const double d : marginal_distances(p.marginals, q.marginals)) out.push_back(d);
  return out;
}

// The longest side of squares that halves of the reference hold, cut across its longer side.
std::uint32_t side_of_halves(const Image& reference) {
  const bool across = reference.width >= reference.height;
  return across ? std::min(reference.width / 2, reference.height)
                : std::min(reference.width, reference.height / 2);
}

// The largest power of two that is a crop's side, at most `fits`, which is at least kLeastTextureCrop.
std::uint32_t largest_crop(std::uint32_t fits) {
  std::uint32_t crop = kLeastTextureCrop;
  while (2 * crop <= std::min(fits, kMostTextureCrop)) crop *= 2;
  return crop;
}

}  // namespace

struct TextureReference::Crops {
  std::uint32_t side = 0;
  ColourAxes axes;
  std::vector<Features> features;
  std::vector<double> ceilings;  // as distances_of
};

Result<std::uint32_t> TextureReference::crop_for(const Image& reference, const Image& candidate) {
  if (reference.channels != candidate.channels) {
    return bad_argument(
        fmt::format("the textures differ in channels: {} and {}", reference.channels, candidate.channels));
  }
  const std::uint32_t fits = std::min({side_of_halves(reference), candidate.width, candidate.height});
  if (fits < kLeastTextureCrop) {
    return bad_argument(
        fmt::format("halves of a reference of {}x{} texels and a candidate of {}x{}, expected "
                    "squares of {}x{} in each",
                    reference.width, reference.height, candidate.width, candidate.height, kLeastTextureCrop,
                    kLeastTextureCrop));
  }
  return largest_crop(fits);
}

TextureReference::Crops TextureReference::crops_for(const Image& reference, std::uint32_t side) {
  const std::vector<Image> crops = crops_of(reference, side);
  Crops own;
  own.side = side;
  own.axes = colour_axes(crops);
  own.features = features_of(own.axes, crops);
  own.ceilings.assign(3 + own.axes.axes.size(), 0);
  const auto count = static_cast<double>(crops.size());
  for (std::size_t i = 0; i < crops.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const std::vector<double> d = distances_of(own.features[j], own.features[i]);
      for (std::size_t m = 0; m < d.size(); ++m) own.ceilings[m] += d[m] / (count * (count - 1) / 2);
    }
  }
  return own;
}

TextureDistances TextureReference::distances(const Crops& own, const Image& candidate) {
  const std::vector<Features> others = features_of(own.axes, crops_of(candidate, own.side));
  const auto pairs = static_cast<double>(own.features.size() * others.size());
  std::vector<AgainstCeiling> mean;
  for (const double ceiling : own.ceilings) mean.push_back({0, ceiling});
  for (const Features& mine : own.features) {
    for (const Features& other : others) {
      const std::vector<double> d = distances_of(mine, other);
      for (std::size_t m = 0; m < mean.size(); ++m) mean[m].value += d[m] / pairs;
    }
  }
  TextureDistances out;
  out.crop = own.side;
  out.spectrum = mean[0];
  out.autocorrelation = mean[1];
  out.stsim2 = mean[2];
  out.marginal.assign(mean.begin() + 3, mean.end());
  const auto count = static_cast<double>(out.marginal.size());
  for (const AgainstCeiling& m : out.marginal) {
    out.marginals.value += m.value / count;
    out.marginals.ceiling += m.ceiling / count;
  }
  return out;
}

TextureReference::TextureReference(Image image) : image_(std::move(image)) {
  if (const std::uint32_t fits = side_of_halves(image_); fits >= kLeastTextureCrop)
    largest_ = std::make_shared<const Crops>(crops_for(image_, largest_crop(fits)));
}

Result<TextureDistances> TextureReference::distances(const Image& candidate) const {
  const Result<std::uint32_t> side = crop_for(image_, candidate);
  if (!side) return side.error();
  return distances(largest_->side == *side ? *largest_ : crops_for(image_, *side), candidate);
}

Result<TextureDistances> texture_distances(const Image& reference, const Image& candidate) {
  const Result<std::uint32_t> side = TextureReference::crop_for(reference, candidate);
  if (!side) return side.error();
  return TextureReference::distances(TextureReference::crops_for(reference, *side), candidate);
}

}  // namespace btfc
