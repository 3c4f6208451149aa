// Channels picked, squares averaged.
#include "encoder/image_reduction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/input/text_numbers.h"
#include "encoder/metrics/lab.h"

namespace btfc {
namespace {

Image picked(const Image& image, const std::vector<std::uint32_t>& channels) {
  Image out = image;
  out.channels = static_cast<std::uint32_t>(channels.size());
  const bool has_alpha =
      image.alpha != Alpha::none && channels.size() > 1 && channels.back() + 1 == image.channels;
  out.alpha = has_alpha ? image.alpha : Alpha::none;
  out.codes.clear();
  for (std::size_t t = 0; t < image.codes.size(); t += image.channels) {
    for (const std::uint32_t c : channels) out.codes.push_back(image.codes[t + c]);
  }
  return out;
}

// Codes <-> what is averaged.
class Averaged {
 public:
  Averaged(const Image& image, bool alpha)
      : type_(image.type),
        srgb_(!alpha && (image.colour_space == ColourSpace::srgb_rec709_scene ||
                         (image.colour_space == ColourSpace::unknown && image.type != SampleType::float16))),
        values_(image.type == SampleType::unorm8 ? 256 : 65536) {
    for (std::size_t code = 0; code < values_.size(); ++code) {
      const double v = code_value(type_, static_cast<std::uint16_t>(code));
      values_[code] = srgb_ ? linear_of_srgb(v) : v;
    }
  }
  double value(std::uint16_t code) const { return values_[code]; }
  std::uint16_t code(double mean) const {
    const double v = srgb_ ? srgb_of_linear(mean) : mean;
    if (type_ == SampleType::float16) return finite_half(static_cast<float>(v)).value_or(0);
    return static_cast<std::uint16_t>(std::lround(v * (type_ == SampleType::unorm8 ? 255 : 65535)));
  }

 private:
  SampleType type_;
  bool srgb_;
  std::vector<double> values_;
};

Image averaged(const Image& image, std::uint32_t scale_log2) {
  const Averaged colour(image, false), alpha(image, true);
  const auto map = [&](std::size_t c) -> const Averaged& {
    return image.alpha != Alpha::none && c + 1 == image.channels ? alpha : colour;
  };
  Image out = image;
  out.width = image.width >> scale_log2;
  out.height = image.height >> scale_log2;
  out.codes.resize(std::size_t{out.width} * out.height * image.channels);
  const std::uint32_t side = 1u << scale_log2;
  std::vector<double> sums(std::size_t{out.width} * image.channels);
  for (std::uint32_t y = 0; y < out.height; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::uint32_t row = 0; row < side; ++row) {
      const std::uint16_t* from = &image.codes[image.index(0, y * side + row, 0)];
      for (std::uint32_t x = 0; x < image.width; ++x) {
        for (std::uint32_t c = 0; c < image.channels; ++c)
          sums[std::size_t{x >> scale_log2} * image.channels + c] += map(c).value(*from++);
      }
    }
    const double area = std::ldexp(1.0, 2 * static_cast<int>(scale_log2));
    for (std::size_t i = 0; i < sums.size(); ++i)
      out.codes[y * sums.size() + i] = map(i % image.channels).code(sums[i] / area);
  }
  return out;
}

}  // namespace

Result<std::vector<std::uint32_t>> channel_numbers(std::span<const std::string> wanted,
                                                   std::span<const std::string> names) {
  std::vector<std::uint32_t> numbers;
  for (const std::string& name : wanted) {
    const auto at = std::find(names.begin(), names.end(), name);
    const auto number = number_of(name);
    if (at != names.end()) {
      numbers.push_back(static_cast<std::uint32_t>(at - names.begin()));
    } else if (number && *number >= 0 && *number < static_cast<double>(names.size()) &&
               *number == std::floor(*number)) {
      numbers.push_back(static_cast<std::uint32_t>(*number));
    } else {
      return bad_argument(fmt::format("there is no channel '{}', expected one of {} or a number from 0 to {}",
                                      name, fmt::join(names.begin(), names.end(), ", "), names.size() - 1));
    }
  }
  std::sort(numbers.begin(), numbers.end());
  if (const auto twice = std::adjacent_find(numbers.begin(), numbers.end()); twice != numbers.end())
    return bad_argument(fmt::format("the channel '{}' is asked for twice", names[*twice]));
  return numbers;
}

Result<Done> check_scale(std::uint32_t width, std::uint32_t height, std::uint32_t scale_log2,
                         const std::string& what) {
  const std::uint32_t side = 1u << scale_log2;
  if (width % side == 0 && height % side == 0) return Done{};
  return bad_argument(
      fmt::format("'{}' has {}x{} texels, of which squares of {}x{} become one; expected sides that they "
                  "divide, such as a region of {}x{}",
                  what, width, height, side, side, std::max(width / side * side, side),
                  std::max(height / side * side, side)));
}

Image reduced(const Image& image, const ImageReduction& reduction) {
  Image out = reduction.channels.empty() ? image : picked(image, reduction.channels);
  return reduction.scale_log2 == 0 ? out : averaged(out, reduction.scale_log2);
}

}  // namespace btfc
