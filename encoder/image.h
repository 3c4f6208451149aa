// An image as the encoder sees it: integer codes of one map, whatever file they came from.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "format/head.h"

namespace btfc {

// width x height texels, rows from the top, channels interleaved. unorm8 codes are 0 … 255; float16 codes are
// the bits of binary16.
struct Image {
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 0;
  SampleType type = SampleType::unorm8;
  ColourSpace colour_space = ColourSpace::unknown;
  Alpha alpha = Alpha::none;
  std::vector<std::uint16_t> codes;

  std::size_t index(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    return (std::size_t{y} * width + x) * channels + channel;
  }
  std::uint16_t at(std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    return codes[index(x, y, channel)];
  }
  std::uint16_t& at(std::uint32_t x, std::uint32_t y, std::uint32_t channel) {
    return codes[index(x, y, channel)];
  }
};

// The value of a code: c / 255, c / 65535, or the half.
float code_value(SampleType type, std::uint16_t code);

// The binary16 code nearest to a value, ties to even; none for NaN and what rounds beyond +-65504.
std::optional<std::uint16_t> finite_half(float value);

// The texels [x, x + width) x [y, y + height), which must lie inside.
Image crop(const Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height);

}  // namespace btfc
