// Small operations on images.
#include "encoder/image.h"

#include <algorithm>
#include <cmath>

#include "shaders/btfc_plane.h"

namespace btfc {

float code_value(SampleType type, std::uint16_t code) {
  return btfc_code_value(static_cast<uint>(type), code);
}

std::optional<std::uint16_t> finite_half(float value) {
  const std::uint32_t code = std::isnan(value) ? 0x7e00u : btfc_float_to_half(value);
  if ((code & 0x7c00u) == 0x7c00u) return std::nullopt;
  return static_cast<std::uint16_t>(code);
}

Image crop(const Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height) {
  Image part = image;
  part.width = width;
  part.height = height;
  part.codes.resize(std::size_t{width} * height * image.channels);
  const std::size_t row = std::size_t{width} * image.channels;
  for (std::uint32_t r = 0; r < height; ++r) {
    const auto from = image.codes.begin() + static_cast<std::ptrdiff_t>(image.index(x, y + r, 0));
    std::copy_n(from, row, part.codes.begin() + static_cast<std::ptrdiff_t>(r * row));
  }
  return part;
}

}  // namespace btfc
