// Averaging down, and laying out.
#include "tools/contact_sheet.h"

#include <algorithm>
#include <cmath>

#include "encoder/metrics/display_values.h"

namespace btfc {
namespace {

constexpr std::uint32_t kLargest = 256, kGap = 4;

// Means of factor x factor texels as 8-bit RGB; the first channel where there are not three.
Image small_picture(const Image& image, const std::vector<float>& display, std::uint32_t factor) {
  Image out;
  out.width = std::max(1u, image.width / factor);
  out.height = std::max(1u, image.height / factor);
  out.channels = 3;
  out.codes.resize(std::size_t{out.width} * out.height * 3);
  for (std::uint32_t y = 0; y < out.height; ++y) {
    for (std::uint32_t x = 0; x < out.width; ++x) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint32_t channel = image.channels >= 3 ? c : 0;
        double sum = 0;
        std::uint32_t count = 0;
        for (std::uint32_t v = y * factor; v < std::min(image.height, (y + 1) * factor); ++v) {
          for (std::uint32_t u = x * factor; u < std::min(image.width, (x + 1) * factor); ++u, ++count) {
            sum += display[image.at(u, v, channel)];
          }
        }
        out.at(x, y, c) = static_cast<std::uint16_t>(std::lround(255 * sum / count));
      }
    }
  }
  return out;
}

}  // namespace

Image contact_sheet(const Dataset& dataset, std::size_t most, std::uint32_t repeats) {
  const std::size_t pairs = dataset.info().pairs.size(), count = std::min(most, pairs);
  const std::uint32_t side = std::max(dataset.info().width, dataset.info().height) * repeats;
  const std::uint32_t factor = (side + kLargest * repeats - 1) / (kLargest * repeats);
  const auto columns = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  const auto rows = static_cast<std::uint32_t>((count + columns - 1) / columns);
  const std::vector<float> display = display_table(dataset.info().type, dataset.info().colour_space);
  Image sheet;
  for (std::size_t n = 0; n < count; ++n) {
    const Image one = small_picture(dataset.image((2 * n + 1) * pairs / (2 * count)), display, factor);
    const std::uint32_t cell_x = one.width * repeats + kGap, cell_y = one.height * repeats + kGap;
    if (n == 0) {
      sheet.width = columns * cell_x - kGap;
      sheet.height = rows * cell_y - kGap;
      sheet.channels = 3;
      sheet.colour_space = ColourSpace::srgb_rec709_scene;
      sheet.codes.assign(std::size_t{sheet.width} * sheet.height * 3, 255);
    }
    const auto column = static_cast<std::uint32_t>(n % columns),
               row = static_cast<std::uint32_t>(n / columns);
    for (std::uint32_t y = 0; y < one.height * repeats; ++y) {
      for (std::uint32_t x = 0; x < one.width * repeats; ++x) {
        for (std::uint32_t c = 0; c < 3; ++c) {
          sheet.at(column * cell_x + x, row * cell_y + y, c) = one.at(x % one.width, y % one.height, c);
        }
      }
    }
  }
  return sheet;
}

}  // namespace btfc
