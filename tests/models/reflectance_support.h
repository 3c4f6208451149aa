// Small data sets of known reflectance, and values of files made of them.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "tests/test_support.h"

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
  DatasetInfo info;
  info.width = width;
  info.height = height;
  for (std::uint32_t c = 0; c < channels; ++c)
    info.channels.push_back(std::string(1, static_cast<char>('A' + c)));
  info.type = type;
  info.views = spread_directions(views, 0.9);
  info.lights = spread_directions(lights);
  make_full_product(info);
  return info;
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

inline FitResult fit_set(const char* model, const Dataset& dataset, const OptionValues& options,
                         unsigned threads = 1) {
  FitInput input;
  input.dataset = &dataset;
  FitSettings settings;
  settings.options = options;
  settings.threads = threads;
  Result<FitResult> result = fitter(find_model(model)->id).fit(input, settings);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  return *std::move(result);
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

inline std::vector<float> random_values(std::mt19937& random, std::size_t count, float least, float most) {
  std::vector<float> values(count);
  for (float& v : values) v = std::uniform_real_distribution<float>(least, most)(random);
  return values;
}

// Directions of whole files made without a fit: all pairs, or all but some.
inline Directions random_directions(std::mt19937& random, std::uint32_t views, std::uint32_t lights) {
  const auto points = [&](std::uint32_t count) {
    std::vector<DirectionPoint> all;
    for (const Direction& d : spread_directions(count)) all.push_back(point_of(d.theta, d.phi));
    return all;
  };
  Directions d{points(views), points(lights), all_pairs(views, lights)};
  if (random() % 2 == 0 && views > 1 && lights > 1) {
    // Without the pairs (0, l), l > 0: every view and light still has one.
    d.pairs.erase(d.pairs.begin() + 1, d.pairs.begin() + lights);
  }
  return d;
}

// A file holds what the formula says, in memory too; written and read again it is the same.
inline void check_sizes(const Head& head, std::vector<RawChunk> chunks) {
  PackOptions options;
  options.codec = Codec::raw;
  const std::vector<RawChunk> before = chunks;
  const Result<Bytes> file = pack_file(std::move(chunks), options);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(verify_bytes(*file)) << verify_bytes(*file).error().message;
  const Result<OpenedFile> opened = open_bytes(*file);
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->head, head);
  EXPECT_EQ(opened->layout.formula_bits, 8 * opened->directory.header.payload_bytes);
  const ByteView view(*file);
  const Result<std::vector<RawChunk>> after = read_all_chunks(source_of(view), opened->directory);
  ASSERT_TRUE(after);
  for (const RawChunk& chunk : before) {
    const auto same = std::count_if(after->begin(), after->end(), [&](const RawChunk& other) {
      return other.key.order() == chunk.key.order() && other.raw == chunk.raw;
    });
    EXPECT_EQ(same, 1) << type_name(chunk.key.type);
  }
  const Result<LoadedItem> item = load_item(source_of(view), *opened);
  ASSERT_TRUE(item);
  std::uint64_t words = 0;
  for (const auto& slot : item->words) words += slot.size();
  EXPECT_EQ(opened->layout.memory_bits, 32 * words);
}

}  // namespace btfc::test
