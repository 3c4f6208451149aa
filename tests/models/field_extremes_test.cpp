// Whole fits of random fields to what is small, flat, periodic or wide, and what comes out of their files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "encoder/synth/btf_synth.h"
#include "tests/btf_support.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

constexpr const char* kModels[] = {"car", "gmrf", "car3d"};

struct Fitted {
  FitResult fit;
  Bytes file;
  float error = 0;
};

Fitted fitted(const char* model, const FitInput& input, const OptionValues& options, std::uint64_t seed = 1,
              unsigned threads = 1) {
  Fitted out;
  FitSettings settings;
  settings.options = options;
  settings.seed = seed;
  settings.threads = threads;
  Result<FitResult> result = fitter(find_model(model)->id).fit(input, settings);
  if (!result) {
    ADD_FAILURE() << model << ": " << result.error().message;
    return out;
  }
  out.fit = *std::move(result);
  out.file = pack(out.fit);
  const Result<Done> good = verify_bytes(out.file);
  EXPECT_TRUE(good) << model << ": " << good.error().message;
  const Result<OpenedFile> opened = open_bytes(out.file);
  if (opened) {
    const Result<FieldShape> shape = read_field_parm(opened->head, opened->parm);
    if (shape) out.error = shape->error;
  }
  EXPECT_GT(out.error, 0);
  return out;
}

FitInput images(const std::vector<Image>& maps) {
  FitInput input;
  for (std::size_t i = 0; i < maps.size(); ++i) input.maps.push_back({fmt::format("map{}", i), maps[i]});
  return input;
}

std::string report(const FitResult& fit, const std::string& name) {
  for (const Parameter& p : fit.report) {
    if (p.name == name) return p.value;
  }
  return "";
}

// Values at both ends of the coordinates, of every level, by tiles and one by one, under directions; all
// finite (rectangle and answers see to that), and both ways within the file's error of the same value, which
// gains and the bump filter may each double.
void expect_decodes(const Fitted& f, const std::string& what) {
  btfc_error error{};
  const TexturePtr texture = load(f.file, &error);
  ASSERT_TRUE(texture) << what << ": " << error.message;
  const ScratchPtr scratch(btfc_scratch_new(texture.get()));
  std::vector<btfc_query> queries;
  SplitMix64 random(2);
  for (std::uint32_t map = 0; map < btfc_texture_maps(texture.get()); ++map) {
    const btfc_directions look{{0.3f, 0.2f, 0.7f}, {-0.4f, 0.5f, 0.3f}, 1, 0};
    (void)rectangle(texture.get(), scratch.get(), look, -9, -5, 20, 20, map);
    for (std::uint32_t level = 0; level < 9; level += 2) {
      btfc_query q{};
      q.x = level == 4 ? INT32_MIN : static_cast<std::int32_t>(random.below(200)) - 100;
      q.y = level == 2 ? INT32_MAX : static_cast<std::int32_t>(random.below(200)) - 100;
      q.map = map;
      q.level = level;
      q.view[2] = 1;
      q.light[0] = 0.5f;
      q.light[2] = 1;
      q.footprint = static_cast<float>(random.below(3));
      if (queries.size() < 6) queries.push_back(q);
    }
  }
  const std::vector<float> tiles = answers(texture.get(), scratch.get(), queries);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const std::vector<float> own = answers(texture.get(), nullptr, {&queries[i], 1});
    for (std::size_t c = 0; c < 4; ++c) ASSERT_NEAR(own[c], tiles[4 * i + c], 8 * f.error) << what;
  }
}

double mean_code(const Image& image) {
  double sum = 0;
  for (const std::uint16_t code : image.codes) sum += static_cast<double>(code_value(image.type, code));
  return sum / static_cast<double>(image.codes.size());
}

double mean_decoded(const Bytes& file, std::uint32_t side = 200) {
  const TexturePtr texture = load(file);
  return mean_of(rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 7, -50, side, side));
}

Image pattern(std::uint32_t width, std::uint32_t height,
              const std::function<bool(std::uint32_t, std::uint32_t)>& high) {
  Image image = constant(width, height, 3, SampleType::unorm8, 30);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      for (std::uint32_t c = 0; c < 3 && high(x, y); ++c)
        image.at(x, y, c) = static_cast<std::uint16_t>(200 + 20 * c);
    }
  }
  return image;
}

// ---- Images of all shapes ----

TEST(FieldExtremes, ConstantsStayConstant) {
  for (const char* model : kModels) {
    for (const char* knots : {"0", "16"}) {
      for (const auto& [width, height] : {std::pair{16u, 16u}, std::pair{1u, 1u}, std::pair{40u, 1u},
                                          std::pair{1u, 33u}, std::pair{4u, 4u}}) {
        const Fitted f =
            fitted(model, images({constant(width, height, 3, SampleType::unorm8, 100)}), {{"knots", knots}});
        expect_decodes(f, model);
        const TexturePtr texture = load(f.file);
        for (const float v : rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 0, 0, 20, 20))
          ASSERT_NEAR(v, 100.0f / 255, 3e-4f) << model << " " << width;
      }
    }
  }
}

TEST(FieldExtremes, TinyNoise) {
  for (const char* model : kModels) {
    for (const auto& [width, height] :
         {std::pair{1u, 1u}, std::pair{2u, 1u}, std::pair{4u, 4u}, std::pair{64u, 1u}, std::pair{5u, 70u}}) {
      for (const char* levels : {"1", "3"}) {
        const Image image = noise(width, height, 3, SampleType::unorm8);
        const Fitted f = fitted(model, images({image}), {{"levels", levels}});
        expect_decodes(f, fmt::format("{} {}x{} {}", model, width, height, levels));
      }
    }
  }
}

TEST(FieldExtremes, PatternsThatPredictThemselves) {
  const std::vector<Image> patterns = {pattern(48, 48, [](auto x, auto) { return x % 4 < 2; }),
                                       pattern(48, 48, [](auto, auto y) { return y % 2 == 0; }),
                                       pattern(48, 48, [](auto x, auto y) { return (x + y) % 2 == 0; }),
                                       pattern(48, 48, [](auto x, auto y) { return x < 24 && y > 10; })};
  for (const char* model : kModels) {
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      for (const char* knots : {"0", "16"}) {
        const Fitted f = fitted(model, images({patterns[i]}), {{"knots", knots}, {"levels", "2"}});
        expect_decodes(f, fmt::format("{} pattern {}", model, i));
        EXPECT_EQ(report(f.fit, "unstable_after_repair"), "0");
      }
    }
  }
}

TEST(FieldExtremes, NoiseKeepsItsMeanAndSpread) {
  for (const char* model : kModels) {
    for (const SampleType type : {SampleType::unorm8, SampleType::unorm16}) {
      for (const std::uint32_t channels : {1u, 2u, 4u}) {
        const Image image = noise(48, 48, channels, type);
        const Fitted f = fitted(model, images({image}), {});
        expect_decodes(f, fmt::format("{} {} channels", model, channels));
        EXPECT_NEAR(mean_decoded(f.file), mean_code(image), 0.02) << model << " " << channels;
        const TexturePtr texture = load(f.file);
        const std::vector<float> values =
            rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 0, 0, 100, 100);
        double squares = 0;
        const double mean = mean_of(values);
        for (const float v : values) squares += (double{v} - mean) * (double{v} - mean);
        // White noise of 0 … 1 has the variance 1/12.
        EXPECT_NEAR(12 * squares / static_cast<double>(values.size()), 1, 0.15) << model << " " << channels;
      }
    }
  }
}

TEST(FieldExtremes, MaterialsKeepTheirMeans) {
  for (const char* model : kModels) {
    for (const char* kind : {"grain", "pebbles"}) {
      const Image used = material(kind, 64, 64);
      const Fitted f = fitted(model, images({used}), {});
      expect_decodes(f, model);
      EXPECT_NEAR(mean_decoded(f.file, 256), mean_code(used), 0.05) << model << " " << kind;
    }
  }
}

TEST(FieldExtremes, HighDynamicRange) {
  Image image = noise(32, 32, 3, SampleType::float16);
  // All halves of noise: +-65504 and subnormals; and a plain one with values above 1.
  Image plain = material("tiles", 48, 48, SampleType::float16);
  for (const char* model : kModels) {
    expect_decodes(fitted(model, images({plain}), {}), model);
    for (const char* precision : {"f32", "f16"}) {
      for (const char* knots : {"0", "16"}) {
        FitSettings settings;
        settings.options = {{"precision", precision}, {"knots", knots}, {"error", "0.5"}};
        settings.threads = 1;
        const Result<FitResult> fit = fitter(find_model(model)->id).fit(images({image}), settings);
        // Values of +-65504 and margins for an error of 1/2: refused in words, or a file that can be decoded.
        if (!fit) {
          EXPECT_FALSE(fit.error().message.empty());
          continue;
        }
        const Bytes file = pack(*fit);
        const Result<Done> good = verify_bytes(file);
        ASSERT_TRUE(good) << good.error().message;
        const TexturePtr texture = load(file);
        ASSERT_TRUE(texture);
        (void)rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 0, 0, 30, 30);
      }
    }
  }
}

TEST(FieldExtremes, SixteenChannels) {
  std::vector<Image> maps;
  for (std::uint32_t i = 0; i < 4; ++i)
    maps.push_back(noise(24, 24, 4, i == 3 ? SampleType::float16 : SampleType::unorm8, i + 1));
  for (std::uint16_t& code : maps[3].codes) code = static_cast<std::uint16_t>(code & 0x3bff);  // 0 … 1
  for (const char* model : kModels) {
    // A coupled field of 16 channels has 256 coefficients a neighbour.
    const bool coupled = std::string(model) == "car3d";
    const Fitted f =
        fitted(model, images(maps), {{"levels", coupled ? "1" : "2"}, {"order", coupled ? "1" : "4"}});
    expect_decodes(f, model);
    const TexturePtr texture = load(f.file);
    ASSERT_EQ(btfc_texture_maps(texture.get()), 4u);
    for (std::uint32_t m = 0; m < 3; ++m) {
      const std::vector<float> values =
          rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 0, 0, 64, 64, m);
      EXPECT_NEAR(mean_of(values), mean_code(maps[m]), 0.03) << model << " " << m;
    }
  }
}

// ---- Options at their ends ----

TEST(FieldExtremes, OrdersLevelsKnotsAndErrors) {
  const Image image = material("tiles", 36, 36);
  const std::vector<OptionValues> all = {{{"order", "0"}},
                                         {{"order", "1"}, {"levels", "8"}},
                                         {{"order", "40"}, {"levels", "1"}, {"knots", "0"}},
                                         {{"order", "auto"}, {"knots", "2"}},
                                         {{"order", "4"}, {"knots", "64"}, {"precision", "f32"}},
                                         {{"order", "4"}, {"error", "1"}},
                                         {{"order", "4"}, {"error", "0.00001"}},
                                         {{"order", "4"}, {"error", "0.000001"}}};
  for (const char* model : kModels) {
    for (const OptionValues& options : all) {
      const Fitted f = fitted(model, images({image}), options);
      std::string what = model;
      for (const auto& [name, value] : options) what += fmt::format(" {}={}", name, value);
      expect_decodes(f, what);
    }
  }
  // An order of 0 is noise: the variance stays, no texel knows its neighbour.
  const Fitted f = fitted("car", images({image}), {{"order", "0"}, {"levels", "1"}, {"knots", "0"}});
  EXPECT_EQ(f.fit.report.size() > 0, true);
  const TexturePtr texture = load(f.file);
  const std::vector<float> v =
      rectangle(texture.get(), nullptr, {{0, 0, 1}, {0, 0, 1}, 1, 0}, 0, 0, 128, 128);
  const double mean = mean_of(v);
  double own = 0, next = 0;
  for (std::size_t i = 0; i + 3 < v.size(); i += 3) {
    own += (double{v[i]} - mean) * (double{v[i]} - mean);
    next += (double{v[i]} - mean) * (double{v[i + 3]} - mean);
  }
  EXPECT_LT(std::fabs(next), 0.2 * own);
}

// A tighter error is kept, by wider margins.
TEST(FieldExtremes, ErrorsAreAsAskedFor) {
  const Image image = material("tiles", 64, 64);
  for (const char* model : {"car", "car3d"}) {
    float before = 2;
    for (const char* error : {"0.1", "0.001", "0.0001"}) {
      const Fitted f = fitted(model, images({image}), {{"error", error}, {"levels", "2"}});
      EXPECT_LE(f.error, std::stof(error) * 1.001f) << model;
      EXPECT_LE(f.error, before) << "margins that FD6 asks for may keep a smaller one";
      before = f.error;
      const TexturePtr texture = load(f.file);
      const ScratchPtr scratch(btfc_scratch_new(texture.get()));
      std::vector<btfc_query> queries(12);
      for (std::size_t i = 0; i < queries.size(); ++i) {
        queries[i].x = static_cast<std::int32_t>(i * 97);
        queries[i].y = static_cast<std::int32_t>(i * i * 13);
      }
      const std::vector<float> tiles = answers(texture.get(), scratch.get(), queries);
      for (std::size_t i = 0; i < queries.size(); ++i) {
        const std::vector<float> one = answers(texture.get(), nullptr, {&queries[i], 1});
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_NEAR(one[c], tiles[4 * i + c], f.error) << model << " " << error;
      }
    }
  }
}

// ---- BTFs ----

TEST(FieldExtremes, SmallBtfs) {
  const Dataset codes = make_btf(btf_info(16, 12, 3, SampleType::unorm8, rings(1), rings(1)), bumpy);
  const Dataset halves = make_btf(btf_info(16, 12, 3, SampleType::float16, rings(1), rings(1)), bumpy);
  const std::vector<std::pair<const Dataset*, OptionValues>> cases = {
      {&codes, {{"clusters", "1"}, {"levels", "2"}, {"order", "3"}}},
      {&codes, {{"clusters", "auto"}, {"levels", "2"}, {"order", "3"}}},
      {&codes, {{"clusters", "49"}, {"levels", "1"}, {"order", "1"}, {"range", "8x8"}}},
      {&halves, {{"clusters", "5"}, {"levels", "2"}, {"order", "3"}}},
      {&codes, {{"clusters", "2"}, {"range", "0"}, {"knots", "0"}, {"levels", "1"}}},
      {&halves, {{"clusters", "2"}, {"range", "16x12"}, {"range-bits", "16"}, {"order", "2"}}}};
  for (const char* model : kModels) {
    for (const auto& [dataset, options] : cases) {
      FitInput input;
      input.dataset = dataset;
      const Fitted f = fitted(model, input, options);
      expect_decodes(f, model);
      if (options.at("clusters") == "49") {
        EXPECT_GT(std::stoi(report(f.fit, "clusters")), 30);
      }
    }
  }
}

TEST(FieldExtremes, OddBtfs) {
  // One direction, one texel, all the same.
  const Dataset single =
      make_btf(btf_info(1, 1, 1, SampleType::unorm8, rings(0), rings(0)), [](auto&&...) { return 0.5; });
  const Dataset flat =
      make_btf(btf_info(8, 8, 3, SampleType::unorm16, rings(1), rings(0)), [](auto&&...) { return 0.25; });
  const Dataset black =
      make_btf(btf_info(8, 8, 3, SampleType::float16, rings(0), rings(1)), [](auto&&...) { return 0.0; });
  for (const char* model : kModels) {
    for (const auto& [dataset, value] :
         {std::pair{&single, 0.5f}, std::pair{&flat, 0.25f}, std::pair{&black, 0.0f}}) {
      FitInput input;
      input.dataset = dataset;
      const Fitted f = fitted(model, input, {});
      expect_decodes(f, model);
      const TexturePtr texture = load(f.file);
      for (const float v :
           rectangle(texture.get(), nullptr, {{0.2f, 0, 1}, {0, 0.5f, 1}, 1, 0}, 0, 0, 16, 16))
        ASSERT_NEAR(v, value, 3e-3f) << model;
    }
  }
}

// A tile that wraps is analysed as a torus; subspaces' colours are those of their images.
TEST(FieldExtremes, SyntheticBtfKeepsItsColours) {
  BtfSynthOptions options;
  options.width = options.height = 24;
  const Result<Dataset> dataset = synthesize_btf(btf_kinds()[0].name, options);
  ASSERT_TRUE(dataset) << dataset.error().message;
  FitInput input;
  input.dataset = &*dataset;
  const Fitted f =
      fitted("car", input, {{"clusters", "12"}, {"levels", "2"}, {"order", "4"}, {"range", "24x24"}});
  expect_decodes(f, "synthetic");
  const TexturePtr texture = load(f.file);
  // Over all pairs, as one image stands for many: the mean colour is near the set's.
  double ours = 0, theirs = 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < dataset->info().pairs.size(); p += 331, ++count) {
    std::uint32_t view = 0, light = 0;
    btfc_directions look{};
    btfc_texture_pair(texture.get(), static_cast<std::uint32_t>(p), &view, &light);
    btfc_texture_view(texture.get(), view, look.view);
    btfc_texture_light(texture.get(), light, look.light);
    ours += mean_of(rectangle(texture.get(), nullptr, look, 0, 0, 96, 96));
    theirs += mean_code(dataset->image(p));
  }
  EXPECT_NEAR(ours / static_cast<double>(count), theirs / static_cast<double>(count), 0.05);
}

// ---- Determinism ----

TEST(FieldExtremes, SameFileOnAnyNumberOfThreadsAnotherForAnotherSeed) {
  const Image image = material("tiles", 48, 48);
  const Dataset dataset = make_btf(btf_info(12, 16, 3, SampleType::unorm8, rings(1), rings(0)), bumpy);
  FitInput btf;
  btf.dataset = &dataset;
  for (const char* model : kModels) {
    for (const FitInput& input : {images({image}), btf}) {
      OptionValues options = {{"levels", "2"}, {"order", "3"}};
      if (input.dataset != nullptr) options["clusters"] = "3";
      const Fitted one = fitted(model, input, options);
      for (const unsigned threads : {input.dataset != nullptr ? 2u : 4u})
        EXPECT_EQ(one.file, fitted(model, input, options, 1, threads).file) << model << " " << threads;
      const Fitted other = fitted(model, input, options, 2);
      const TexturePtr a = load(one.file), b = load(other.file);
      const btfc_directions look{{0, 0, 1}, {0, 0, 1}, 1, 0};
      EXPECT_GT(worst_difference(rectangle(a.get(), nullptr, look, 0, 0, 20, 20),
                                 rectangle(b.get(), nullptr, look, 0, 0, 20, 20)),
                0.01)
          << model;
    }
  }
}

TEST(FieldExtremes, WhatCannotBeIsRefusedInWords) {
  const Image image = noise(16, 16, 3, SampleType::unorm8);
  const std::vector<std::pair<OptionValues, FitInput>> wrong = {
      {{{"order", "41"}}, images({image})},
      {{{"levels", "0"}}, images({image})},
      {{{"levels", "9"}}, images({image})},
      {{{"knots", "1"}}, images({image})},
      {{{"knots", "65"}}, images({image})},
      {{{"error", "0"}}, images({image})},
      {{{"error", "nan"}}, images({image})},
      {{{"precision", "u8"}}, images({image})},
      {{{"range", "0x4"}}, images({image})},
      {{{"range-bits", "12"}}, images({image})},
      {{}, images({image, noise(8, 16, 1, SampleType::unorm8)})},
      {{}, images({image, image, image, image, image, image})}};  // 18 channels
  for (const char* model : kModels) {
    for (const auto& [options, input] : wrong) {
      FitSettings settings;
      settings.options = options;
      settings.threads = 1;
      const Result<FitResult> fit = fitter(find_model(model)->id).fit(input, settings);
      std::string what = model;
      for (const auto& [name, value] : options) what += fmt::format(" {}={}", name, value);
      ASSERT_FALSE(fit) << what;
      EXPECT_EQ(fit.error().status, Status::bad_argument) << what;
      EXPECT_FALSE(fit.error().message.empty());
    }
  }
}

}  // namespace
}  // namespace btfc::test
