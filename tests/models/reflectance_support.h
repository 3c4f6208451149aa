// Small data sets of known reflectance, and values of files made of them.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include "tests/btf_support.h"

namespace btfc::test {

// Value 0 … 1 of a texel and channel under a view and a light.
using Reflectance = std::function<double(std::size_t view, const Vector3& light, std::uint32_t x,
                                         std::uint32_t y, std::uint32_t channel)>;

// Well spread directions with theta up to `most` radians; the first is the normal.
inline std::vector<Direction> spread_directions(std::size_t count, double most = 1.3) {
  std::vector<Direction> all;
  for (std::size_t i = 0; i < count; ++i) {
    const double f = static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(count - 1, 1));
    all.push_back({most * std::sqrt(f), std::fmod(2.399963 * static_cast<double>(i), 6.283185)});
  }
  return all;
}

inline DatasetInfo small_info(std::uint32_t width, std::uint32_t height, std::uint32_t channels,
                              std::size_t views, std::size_t lights, SampleType type = SampleType::unorm16) {
  return btf_info(width, height, channels, type, spread_directions(views, 0.9), spread_directions(lights));
}

inline Dataset make_dataset(const DatasetInfo& info, const Reflectance& value) {
  Result<Dataset> dataset = Dataset::create(info, "");
  if (!dataset) throw std::runtime_error(dataset.error().message);
  const double white = info.type == SampleType::unorm8 ? 255 : 65535;
  for (std::size_t pair = 0; pair < info.pairs.size(); ++pair) {
    std::vector<std::uint16_t> codes;
    const Vector3 light = unit_vector(info.lights[info.pairs[pair].light]);
    for (std::uint32_t y = 0; y < info.height; ++y) {
      for (std::uint32_t x = 0; x < info.width; ++x) {
        for (std::uint32_t c = 0; c < info.channel_count(); ++c) {
          const double v = std::clamp(value(info.pairs[pair].view, light, x, y, c), 0.0, 1.0);
          codes.push_back(static_cast<std::uint16_t>(std::lround(v * white)));
        }
      }
    }
    dataset->write_image(pair, codes);
  }
  return std::move(*dataset);
}

inline double reported(const FitResult& fit, const char* name) {
  for (const Parameter& p : fit.report) {
    if (p.name == name) return std::stod(p.value);
  }
  ADD_FAILURE() << name;
  return 0;
}

inline std::vector<float> values_at(const btfc_texture* texture, const Vector3& view, const Vector3& light,
                                    std::int32_t x, std::int32_t y) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, 0, &info);
  btfc_query query{};
  query.x = x;
  query.y = y;
  for (std::size_t i = 0; i < 3; ++i) {
    query.view[i] = static_cast<float>(view[i]);
    query.light[i] = static_cast<float>(light[i]);
  }
  std::vector<float> values(info.channels);
  EXPECT_EQ(btfc_eval(texture, nullptr, &query, sizeof query, 1, values.data(), info.channels), BTFC_OK);
  return values;
}

// The largest error of a file over all measured pairs.
inline double worst_error(const Bytes& file, const DatasetInfo& info, const Reflectance& value) {
  const TexturePtr texture = load(file);
  if (!texture) {
    ADD_FAILURE();
    return 1e9;
  }
  double worst = 0;
  for (const DirectionPair& pair : info.pairs) {
    const Vector3 light = unit_vector(info.lights[pair.light]);
    for (std::uint32_t y = 0; y < info.height; ++y) {
      for (std::uint32_t x = 0; x < info.width; ++x) {
        const auto found = values_at(texture.get(), unit_vector(info.views[pair.view]), light,
                                     static_cast<std::int32_t>(x), static_cast<std::int32_t>(y));
        for (std::uint32_t c = 0; c < info.channel_count(); ++c) {
          const double error = std::fabs(found[c] - value(pair.view, light, x, y, c));
          worst = error <= worst ? worst : error;  // what is no number counts
        }
      }
    }
  }
  return worst;
}

}  // namespace btfc::test
