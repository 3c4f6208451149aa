// Rows of the grid -> values along the axes -> cumulative histograms.
#include "encoder/segment/colour_histograms.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "encoder/metrics/lab.h"

namespace btfc {
namespace {

struct Axis {
  float from = 0, to = 1;
  double weight = 1;  // of the squared distance, besides the bin's width
};

std::vector<Axis> axes_of(const CodeView& image) {
  constexpr Axis kLightness{0, 100, 1}, kColour{-110, 110, 1};
  switch (image.meaning) {
    case ColourMeaning::grey:
      return {kLightness};
    case ColourMeaning::rgb:
      return {kLightness, kColour, kColour};
    case ColourMeaning::none:
      break;
  }
  return std::vector<Axis>(image.channels, Axis{0, 100, 1.0 / image.channels});
}

// Places every `step` texels along a side, half a step from its ends or so; one at least.
struct Places {
  std::uint32_t first = 0, step = 1, count = 0;
  Places(std::uint32_t side, std::uint32_t every)
      : first(std::min(every / 2, side - 1)), step(every), count((side - 1 - first) / every + 1) {}
  std::uint32_t operator[](std::uint32_t i) const { return first + i * step; }
};

std::uint32_t grid_step(std::uint32_t width, std::uint32_t height) {
  std::uint32_t step = 1;
  while (std::size_t{Places(width, step).count} * Places(height, step).count > kMostHistogramTexels) ++step;
  return step;
}

// A value counts for a part in the bin that holds it and wholly in all after it.
class Cumulative {
 public:
  explicit Cumulative(const Axis& axis)
      : axis_(axis), part_(kHistogramBins + 1), after_(kHistogramBins + 1) {}

  void add(std::span<const float> values) {
    constexpr auto kBins = static_cast<float>(kHistogramBins);
    const float scale = kBins / (axis_.to - axis_.from);
    for (const float v : values) {
      const float at = std::clamp((v - axis_.from) * scale, 0.0f, kBins);
      const auto bin = static_cast<std::size_t>(at);
      part_[bin] += static_cast<double>(static_cast<float>(bin + 1) - at);
      after_[bin] += 1;
    }
    count_ += static_cast<double>(values.size());
  }

  void write(float* features) const {
    const double width = static_cast<double>(axis_.to - axis_.from) / static_cast<double>(kHistogramBins);
    const double scale = std::sqrt(axis_.weight * width) / count_;
    double below = 0;
    for (std::size_t bin = 0; bin < kHistogramBins; ++bin) {
      features[bin] = static_cast<float>(scale * (below + part_[bin]));
      below += after_[bin];
    }
  }

 private:
  Axis axis_;
  std::vector<double> part_, after_;  // the last of each: values at the range's end
  double count_ = 0;
};

// Values of a row's places along each axis; rows[c] has the image's width.
void read_row(const CodeView& image, std::uint32_t y, const Places& xs,
              std::span<const std::span<float>> rows) {
  if (image.meaning == ColourMeaning::none) {
    const std::uint16_t* codes = &image.codes[std::size_t{y} * image.width * image.channels];
    for (std::uint32_t i = 0; i < xs.count; ++i) {
      for (std::uint32_t c = 0; c < image.channels; ++c)
        rows[c][i] = 100 * image.tables->display[codes[std::size_t{xs[i]} * image.channels + c]];
    }
    return;
  }
  image.linear_row(y, rows[0], rows[1], rows[2]);
  for (std::uint32_t i = 0; i < xs.count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) rows[c][i] = rows[c][xs[i]];
  }
  lab_row(rows[0].first(xs.count), rows[1].first(xs.count), rows[2].first(xs.count));
}

}  // namespace

std::vector<float> colour_histograms(const CodeView& image) {
  const std::vector<Axis> axes = axes_of(image);
  std::vector<Cumulative> histograms(axes.begin(), axes.end());
  const std::uint32_t step = grid_step(image.width, image.height);
  const Places xs(image.width, step), ys(image.height, step);
  std::vector<float> buffer(std::max<std::size_t>(3, axes.size()) * image.width);
  std::vector<std::span<float>> rows;
  for (std::size_t at = 0; at < buffer.size(); at += image.width)
    rows.push_back(std::span(buffer).subspan(at, image.width));
  for (std::uint32_t j = 0; j < ys.count; ++j) {
    read_row(image, ys[j], xs, rows);
    for (std::size_t c = 0; c < axes.size(); ++c) histograms[c].add(rows[c].first(xs.count));
  }
  std::vector<float> features(axes.size() * kHistogramBins);
  for (std::size_t c = 0; c < axes.size(); ++c) histograms[c].write(&features[c * kHistogramBins]);
  return features;
}

}  // namespace btfc
