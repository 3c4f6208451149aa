// Samples in bands of rows on scratch space.
#include "encoder/dataset/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "format/checked.h"
#include "format/limits.h"

namespace btfc {
namespace {

// A band's rows of one image should fill about a page, so that writing image after image dirties each page
// a few times only.
constexpr std::uint64_t kBandBytes = 4096;

Result<Done> check(const DatasetInfo& info) {
  if (info.width < 1 || info.height < 1 || info.width > kMaxSide || info.height > kMaxSide) {
    return bad_argument(fmt::format("a data set of {}x{} texels, expected 1 to {} a side", info.width,
                                    info.height, kMaxSide));
  }
  if (info.channels.empty() || info.channels.size() > kMaxDatasetChannels) {
    return bad_argument(fmt::format("a data set of {} channels, expected 1 to {}", info.channels.size(),
                                    kMaxDatasetChannels));
  }
  if (info.pairs.empty() || info.pairs.size() > kMaxPairs || info.views.size() > kMaxDirections ||
      info.lights.size() > kMaxDirections) {
    return bad_argument(
        fmt::format("a data set of {} images, {} views and {} lights, expected 1 to {} images "
                    "and at most {} directions each",
                    info.pairs.size(), info.views.size(), info.lights.size(), kMaxPairs, kMaxDirections));
  }
  for (const auto* directions : {&info.views, &info.lights}) {
    for (const Direction& d : *directions) {
      if (!(d.theta >= 0 && d.theta <= std::numbers::pi / 2 + 1e-6)) {
        return bad_argument(
            fmt::format("the direction {} lies below the surface, expected theta from 0 to 90", to_text(d)));
      }
    }
  }
  if (!info.weights.empty()) {
    double sum = 0;
    bool positive = info.weights.size() == info.pairs.size();
    for (const double weight : info.weights) {
      positive = positive && std::isfinite(weight) && weight > 0;
      sum += weight;
    }
    const double count = static_cast<double>(info.pairs.size());
    if (!positive || std::abs(sum / count - 1) > 1e-6) {
      return bad_argument(fmt::format(
          "the data set has {} weights, expected none or one above 0 for each of {} pairs, with mean 1",
          info.weights.size(), info.pairs.size()));
    }
  }
  const DirectionPair* before = nullptr;
  for (const DirectionPair& pair : info.pairs) {
    if (pair.view >= info.views.size() || pair.light >= info.lights.size()) {
      return bad_argument(fmt::format("an image of view {} and light {}, of {} and {}", pair.view, pair.light,
                                      info.views.size(), info.lights.size()));
    }
    if (before != nullptr &&
        (before->view > pair.view || (before->view == pair.view && before->light >= pair.light))) {
      return bad_argument(fmt::format("images of view {} {} and light {} {} come twice or out of order",
                                      pair.view, to_text(info.views[pair.view]), pair.light,
                                      to_text(info.lights[pair.light])));
    }
    before = &pair;
  }
  return Done{};
}

}  // namespace

void make_full_product(DatasetInfo& info) {
  info.pairs.clear();
  for (std::uint32_t v = 0; v < info.views.size(); ++v) {
    for (std::uint32_t l = 0; l < info.lights.size(); ++l) info.pairs.push_back({v, l});
  }
}

Image image_of(const DatasetInfo& info, std::vector<std::uint16_t> codes) {
  Image image;
  image.width = info.width;
  image.height = info.height;
  image.channels = info.channel_count();
  image.type = info.type;
  image.colour_space = info.colour_space;
  image.codes = std::move(codes);
  return image;
}

Result<Dataset> Dataset::create(DatasetInfo info, const std::string& scratch_directory) {
  if (const auto good = check(info); !good) return good.error();
  // Weights that are all the same are none.
  if (std::adjacent_find(info.weights.begin(), info.weights.end(), std::not_equal_to<>()) ==
      info.weights.end())
    info.weights.clear();
  const std::uint64_t bytes = info.type == SampleType::unorm8 ? 1 : 2;
  const CheckedSize row = CheckedSize(info.width) * info.channels.size() * bytes;
  const CheckedSize size = row * info.height * info.pairs.size();
  const auto rows =
      static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kBandBytes / row.saturated(), 1, info.height));
  Result<Scratch> scratch = Scratch::create(size.saturated(), scratch_directory);
  if (!scratch) return scratch.error();
  return Dataset(std::move(info), std::move(*scratch), rows);
}

std::uint8_t* Dataset::row_data(std::size_t pair, std::uint32_t y) const {
  const std::uint32_t begin = y / band_rows_ * band_rows_;
  const std::size_t rows = std::min(band_rows_, info_.height - begin);
  return scratch_.data() + (begin * info_.pairs.size() + rows * pair + (y - begin)) * row_bytes_;
}

void Dataset::write_image(std::size_t pair, std::span<const std::uint16_t> codes) {
  const std::size_t samples = row_bytes_ / bytes_;
  for (std::uint32_t y = 0; y < info_.height; ++y) {
    const auto from = codes.subspan(y * samples, samples);
    std::uint8_t* row = row_data(pair, y);
    if (bytes_ == 1) {
      std::transform(from.begin(), from.end(), row,
                     [](std::uint16_t c) { return static_cast<std::uint8_t>(c); });
    } else {
      std::copy(from.begin(), from.end(), reinterpret_cast<std::uint16_t*>(row));
    }
  }
}

void Dataset::read_image(std::size_t pair, std::span<std::uint16_t> codes) const {
  const std::size_t samples = row_bytes_ / bytes_;
  for (std::uint32_t y = 0; y < info_.height; ++y) {
    std::uint16_t* to = codes.data() + y * samples;
    const std::uint8_t* row = row_data(pair, y);
    if (bytes_ == 1) {
      std::copy_n(row, samples, to);
    } else {
      std::copy_n(reinterpret_cast<const std::uint16_t*>(row), samples, to);
    }
  }
}

Image Dataset::image(std::size_t pair) const {
  Image out = image_of(info_, std::vector<std::uint16_t>(info_.image_samples()));
  read_image(pair, out.codes);
  return out;
}

void Dataset::read_texels(std::uint32_t x, std::uint32_t y, std::uint32_t count,
                          std::span<std::uint16_t> codes) const {
  const std::size_t channels = info_.channels.size(), pairs = info_.pairs.size();
  for (std::size_t pair = 0; pair < pairs; ++pair) {
    const std::uint8_t* row = row_data(pair, y) + x * channels * bytes_;
    for (std::size_t t = 0; t < count; ++t) {
      std::uint16_t* to = codes.data() + (t * pairs + pair) * channels;
      if (bytes_ == 1) {
        std::copy_n(row + t * channels, channels, to);
      } else {
        std::copy_n(reinterpret_cast<const std::uint16_t*>(row) + t * channels, channels, to);
      }
    }
  }
}

}  // namespace btfc
