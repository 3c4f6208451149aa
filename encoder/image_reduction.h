// Fewer channels and larger texels of images: what a viewer needs who never comes near.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

struct ImageReduction {
  std::vector<std::uint32_t> channels;  // the ones to keep, ascending; empty: all
  std::uint32_t scale_log2 = 0;         // a square of 2^scale_log2 texels a side becomes one
  bool none() const { return channels.empty() && scale_log2 == 0; }
};

// Names to numbers: each is one of the names, or a number from 0. Refused: none of both, one twice.
Result<std::vector<std::uint32_t>> channel_numbers(std::span<const std::string> wanted,
                                                   std::span<const std::string> names);

// Refused, by a sentence that names `what`: sides that the scale does not divide.
Result<Done> check_scale(std::uint32_t width, std::uint32_t height, std::uint32_t scale_log2,
                         const std::string& what);

// A texel is the mean of the square that it stands for, as an eye or a camera takes it from afar: in linear
// light where the codes are sRGB-coded (srgb_rec709_scene, and integers of unknown colour space), of the
// values themselves otherwise, alpha among them. The image must have the channels, and sides that check_scale
// accepts.
Image reduced(const Image& image, const ImageReduction& reduction);

}  // namespace btfc
