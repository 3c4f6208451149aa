// Averaging down, and laying out.
#include "tools/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

// One picture, texels repeated `larger` times each way, its top left texel at (x, y) of the sheet.
void place(const Image& one, std::uint32_t larger, std::uint32_t x, std::uint32_t y, Image& sheet) {
  for (std::uint32_t v = 0; v < one.height * larger; ++v) {
    for (std::uint32_t u = 0; u < one.width * larger; ++u) {
      for (std::uint32_t c = 0; c < 3; ++c) sheet.at(x + u, y + v, c) = one.at(u / larger, v / larger, c);
    }
  }
}

// Pair numbers by the angles of view and light together, evenly from the least to the most.
std::vector<std::size_t> by_obliqueness(const DatasetInfo& info, std::size_t most) {
  std::vector<std::size_t> order(info.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto angle = [&](std::size_t p) {
    return info.views[info.pairs[p].view].theta + info.lights[info.pairs[p].light].theta;
  };
  std::stable_sort(order.begin(), order.end(), [&](auto p, auto q) { return angle(p) < angle(q); });
  const std::size_t count = std::min(most, order.size());
  std::vector<std::size_t> chosen;
  for (std::size_t n = 0; n < count; ++n)
    chosen.push_back(order[count == 1 ? 0 : n * (order.size() - 1) / (count - 1)]);
  return chosen;
}

Image blank_sheet(std::uint32_t width, std::uint32_t height) {
  Image sheet;
  sheet.width = width;
  sheet.height = height;
  sheet.channels = 3;
  sheet.colour_space = ColourSpace::srgb_rec709_scene;
  sheet.codes.assign(std::size_t{width} * height * 3, 255);
  return sheet;
}

}  // namespace

Image comparison_sheet(const Dataset& a, const Dataset& b, std::size_t most) {
  const std::vector<std::size_t> pairs = by_obliqueness(a.info(), most);
  const std::uint32_t side = std::max(a.info().width, a.info().height);
  const std::uint32_t factor = (side + kLargest - 1) / kLargest, larger = std::max(1u, kLargest / side);
  Image sheet;
  std::uint32_t row = 0;
  for (const Dataset* dataset : {&a, &b}) {
    const std::vector<float> display = display_table(dataset->info().type, dataset->info().colour_space);
    for (std::size_t n = 0; n < pairs.size(); ++n) {
      const Image one = small_picture(dataset->image(pairs[n]), display, factor);
      const std::uint32_t cell_x = one.width * larger + kGap, cell_y = one.height * larger + kGap;
      if (sheet.codes.empty())
        sheet = blank_sheet(static_cast<std::uint32_t>(pairs.size()) * cell_x - kGap, 2 * cell_y - kGap);
      place(one, larger, static_cast<std::uint32_t>(n) * cell_x, row * cell_y, sheet);
    }
    ++row;
  }
  return sheet;
}

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
      sheet = blank_sheet(columns * cell_x - kGap, rows * cell_y - kGap);
    }
    const auto column = static_cast<std::uint32_t>(n % columns),
               row = static_cast<std::uint32_t>(n / columns);
    for (std::uint32_t v = 0; v < repeats; ++v) {
      for (std::uint32_t u = 0; u < repeats; ++u)
        place(one, 1, column * cell_x + u * one.width, row * cell_y + v * one.height, sheet);
    }
  }
  return sheet;
}

}  // namespace btfc
