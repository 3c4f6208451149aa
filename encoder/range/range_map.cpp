// Codes -> luminance -> normals -> heights -> means over boxes.
#include "encoder/range/range_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/view_pairs.h"
#include "encoder/metrics/lab.h"
#include "encoder/range/integrate_normals.h"

namespace btfc {
namespace {

// Code -> linear value, 0 and more.
std::vector<float> linear_table(const DatasetInfo& info, bool linear_codes) {
  const bool srgb = info.colour_space == ColourSpace::srgb_rec709_scene && !linear_codes;
  std::vector<float> table(info.type == SampleType::unorm8 ? 256 : 65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    auto v = static_cast<double>(code_value(info.type, static_cast<std::uint16_t>(code)));
    if (!std::isfinite(v)) v = 0;
    v = std::max(v, 0.0);
    if (srgb) v = linear_of_srgb(v);
    table[code] = static_cast<float>(v);
  }
  return table;
}

// Of each channel in the luminance; their sum is 1.
std::vector<float> channel_weights(const DatasetInfo& info) {
  const auto& names = info.channels;
  const auto weights_of = [&](auto weight) {
    std::vector<float> weights;
    float sum = 0;
    for (const std::string& name : names) {
      weights.push_back(weight(name));
      sum += weights.back();
    }
    for (float& w : weights) w /= sum;
    return weights;
  };
  const auto has = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (has("R") && has("G") && has("B")) {
    return weights_of([](const std::string& name) {
      return name == "R" ? 0.2126f : name == "G" ? 0.7152f : name == "B" ? 0.0722f : 0.0f;
    });
  }
  const bool alpha = has("A") && names.size() > 1;
  return weights_of([&](const std::string& name) { return alpha && name == "A" ? 0.0f : 1.0f; });
}

// The share of source texel k in the mean over target texel i of n.
struct Share {
  std::size_t k;
  double weight;
};
std::vector<std::vector<Share>> box_shares(std::uint32_t from, std::uint32_t to) {
  std::vector<std::vector<Share>> shares(to);
  // In parts of 1 / to of a source texel: texel k is [k to, (k + 1) to), target i [i from, (i + 1) from).
  for (std::uint64_t i = 0; i < to; ++i) {
    const std::uint64_t begin = i * from, end = begin + from;
    for (std::uint64_t k = begin / to; k * to < end; ++k) {
      const std::uint64_t overlap = std::min(end, (k + 1) * to) - std::max(begin, k * to);
      shares[i].push_back({k, static_cast<double>(overlap) / from});
    }
  }
  return shares;
}

std::vector<float> box_means(const std::vector<float>& heights, std::uint32_t from_width,
                             std::uint32_t from_height, std::uint32_t width, std::uint32_t height) {
  const auto columns = box_shares(from_width, width), rows = box_shares(from_height, height);
  std::vector<float> out;
  out.reserve(std::size_t{width} * height);
  for (const auto& row : rows) {
    for (const auto& column : columns) {
      double sum = 0;
      for (const Share& y : row) {
        for (const Share& x : column)
          sum += y.weight * x.weight * static_cast<double>(heights[y.k * from_width + x.k]);
      }
      out.push_back(static_cast<float>(sum));
    }
  }
  return out;
}

// Number of the view nearest the normal, of those with images.
std::uint32_t top_view(const DatasetInfo& info) {
  std::uint32_t best = info.pairs.front().view;
  for (const DirectionPair& pair : info.pairs) {
    if (info.views[pair.view].theta < info.views[best].theta) best = pair.view;
  }
  return best;
}

RangeMap flat(std::uint32_t width, std::uint32_t height, std::string note) {
  return {width, height, std::vector<float>(std::size_t{width} * height), 0, std::move(note)};
}

}  // namespace

std::vector<TexelSurface> surface_of_view(const Dataset& dataset, std::uint32_t view,
                                          const RangeOptions& options) {
  const DatasetInfo& info = dataset.info();
  const ViewPairs pairs = pairs_of_views(info)[view];
  std::vector<Vector3> lights;
  for (std::size_t pair = pairs.first; pair < pairs.first + pairs.count; ++pair)
    lights.push_back(unit_vector(info.lights[info.pairs[pair].light]));
  const StereoOptions stereo{options.method, info.quantity != Quantity::reflectance};
  const std::vector<float> linear = linear_table(info, options.linear_codes), weights = channel_weights(info);
  const std::size_t width = info.width;
  std::vector<TexelSurface> surface(width * info.height);
  tbb::parallel_for(std::uint32_t{0}, info.height, [&](std::uint32_t y) {
    std::vector<float> values(pairs.count * width);
    for (std::size_t i = 0; i < pairs.count; ++i) {
      for (std::uint32_t x = 0; x < info.width; ++x) {
        float sum = 0;
        for (std::uint32_t c = 0; c < info.channel_count(); ++c)
          sum += weights[c] * linear[dataset.code(pairs.first + i, x, y, c)];
        values[i * width + x] = sum;
      }
    }
    const auto row = photometric_stereo(lights, values, width, stereo);
    std::copy(row.begin(), row.end(), surface.begin() + static_cast<std::ptrdiff_t>(y * width));
  });
  return surface;
}

Result<RangeMap> estimate_range_map(const Dataset& dataset, std::uint32_t width, std::uint32_t height,
                                    const RangeOptions& options) {
  const DatasetInfo& info = dataset.info();
  if (width < 1 || height < 1 || width > info.width || height > info.height) {
    return bad_argument(
        fmt::format("a range map of {}x{} texels of a tile of {}x{}, expected 1 to the tile's", width, height,
                    info.width, info.height));
  }
  if (info.quantity == Quantity::data)
    return flat(width, height, "the values are no quantity of light: the range map is flat");
  const std::uint32_t view = top_view(info);
  if (!(degrees(info.views[view].theta) <= kMostViewDegrees)) {
    return flat(
        width, height,
        fmt::format("the view nearest the normal is {}, more than {} degrees off: the range map is flat",
                    to_text(info.views[view]), kMostViewDegrees));
  }
  const std::vector<TexelSurface> surface = surface_of_view(dataset, view, options);
  const auto known = std::count_if(surface.begin(), surface.end(), [](const auto& s) { return s.known; });
  if (known == 0) {
    return flat(
        width, height,
        fmt::format("no texel's normal is known from the {} lights of the view {}: the range map is flat",
                    pairs_of_views(info)[view].count, to_text(info.views[view])));
  }
  const std::vector<float> heights = integrate_normals(surface, info.width, info.height);
  return RangeMap{width, height, box_means(heights, info.width, info.height, width, height),
                  static_cast<double>(known) / static_cast<double>(surface.size()), ""};
}

}  // namespace btfc
