// The shaders on a Vulkan device: every model in compute and fragment stages against the CPU, samples
// whatever the bits of their arguments, robust mode, slots, and what is said where there is no device. The
// validation layer is on where it is installed, and silent.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "encoder/output/atomic_file.h"
#include "shaders/btfc_uv.h"
#include "shaders/models/ptm.h"
#include "tests/shader_support.h"
#include "tests/test_support.h"
#include "tools/vulkan_needs.h"

namespace btfc::test {
namespace {

class Shaders : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!why_no_shaders().empty()) GTEST_SKIP() << why_no_shaders();
  }
};
INSTANTIATE_TEST_SUITE_P(Models, Shaders, testing::ValuesIn([] {
                           std::vector<const char*> names;
                           for (const ModelFormat& model : models()) names.push_back(model.name);
                           return names;
                         }()),
                         [](const auto& test) { return std::string(test.param); });
// The same without a model of its own.
class ShaderRunner : public testing::Test {
 protected:
  void SetUp() override {
    if (!why_no_shaders().empty()) GTEST_SKIP() << why_no_shaders();
  }
};

Bytes file_of(const std::filesystem::path& path) {
  const Result<Bytes> bytes = read_file(path.string());
  EXPECT_TRUE(bytes) << path;
  return bytes ? *bytes : Bytes();
}

// Opened with the validation layer where that is there; the test fails where it does not open.
std::optional<VulkanDecoder> open_decoder(const btfc_texture* texture, VulkanOptions options = {}) {
  options.validation = validation_installed();
  options.window = window_for(texture);
  Result<VulkanDecoder> made = VulkanDecoder::open(texture, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  if (!made) return std::nullopt;
  return std::move(*made);
}

void expect_silent(const VulkanDecoder& decoder) {
  for (const std::string& message : decoder.messages()) ADD_FAILURE() << message;
}

std::vector<float> values_of(const Result<std::vector<float>>& values) {
  EXPECT_TRUE(values) << (values ? "" : values.error().message);
  return values ? *values : std::vector<float>();
}

std::uint32_t channels_of(const btfc_texture* texture, std::uint32_t map) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  return info.channels;
}

// Under the first pair, between measured directions, grazing, below the horizon, through a box of texels.
std::vector<btfc_directions> some_directions(const btfc_texture* texture) {
  btfc_directions measured{{0, 0, 1}, {0, 0, 1}, 1, 0};
  btfc_texture_view(texture, 0, measured.view);
  btfc_texture_light(texture, 0, measured.light);
  return {measured,
          {{0.31f, -0.2f, 0.8f}, {-0.4f, 0.35f, 0.7f}, 1, 0},
          {{0.9f, 0.4f, 0.02f}, {-0.3f, -0.95f, -0.4f}, 3, 0}};
}

TEST_P(Shaders, EveryVectorInBothStages) {
  Difference all;
  for (const std::filesystem::path& path : vectors_of(GetParam())) {
    const Bytes file = file_of(path);
    const TexturePtr texture = load(file);
    ASSERT_NE(texture, nullptr) << path;
    const double most = shader_tolerance(GetParam(), stated_error(file));
    std::optional<VulkanDecoder> decoder = open_decoder(texture.get());
    ASSERT_TRUE(decoder);
    const btfc_gpu_window window = window_for(texture.get());
    // Beyond the border on all sides; of unbounded textures what was prepared.
    const std::int32_t x = window.width > 0 ? window.x : -3, y = window.width > 0 ? window.y : -2;
    const std::uint32_t width =
        std::min(window.width > 0 ? window.width : btfc_texture_width(texture.get()) + 7, 70u);
    const std::uint32_t height =
        std::min(window.width > 0 ? window.height : btfc_texture_height(texture.get()) + 5, 70u);
    for (std::uint32_t map = 0; map < btfc_texture_maps(texture.get()); ++map) {
      const std::uint32_t channels = channels_of(texture.get(), map);
      const auto queries = random_queries(texture.get(), map, window, 400);
      const std::vector<float> answers = cpu_values(texture.get(), map, queries);
      for (const ShaderStage stage : {ShaderStage::compute, ShaderStage::fragment}) {
        const auto hold = [&](std::span<const float> expected, const Result<std::vector<float>>& got) {
          const Difference d = difference(expected, values_of(got), channels);
          EXPECT_LE(d.worst, most) << path << " map " << map << " fragment "
                                   << (stage == ShaderStage::fragment);
          all.values += d.values;
          all.differing += d.differing;
          all.worst = std::max(all.worst, d.worst);
        };
        for (const btfc_directions& directions : some_directions(texture.get())) {
          hold(cpu_rectangle(texture.get(), map, directions, x, y, width, height),
               decoder->rectangle(stage, map, directions, x, y, width, height));
        }
        hold(answers, decoder->queries(stage, map, queries));
      }
    }
    expect_silent(*decoder);
  }
  std::cout << GetParam() << ": " << all.differing << " of " << all.values << " values differ, by at most "
            << all.worst << "\n";
}

// The entry point for any model, parameters from the buffer: the same values, bit for bit.
TEST_P(Shaders, GeneralEntryPointAndParametersFromTheBuffer) {
  const Bytes file = file_of(vectors_of(GetParam()).front());
  const TexturePtr texture = load(file);
  std::optional<VulkanDecoder> made = open_decoder(texture.get());
  VulkanOptions options;
  options.general = true;
  options.baked = false;
  std::optional<VulkanDecoder> general = open_decoder(texture.get(), options);
  ASSERT_TRUE(made && general);
  const auto queries = random_queries(texture.get(), 0, window_for(texture.get()), 500);
  const std::vector<float> a = values_of(made->queries(ShaderStage::compute, 0, queries)),
                           b = values_of(general->queries(ShaderStage::compute, 0, queries));
  ASSERT_EQ(a.size(), 4 * queries.size());
  ASSERT_EQ(b.size(), a.size());
  EXPECT_LE(difference(cpu_values(texture.get(), 0, queries), b, channels_of(texture.get(), 0)).worst,
            shader_tolerance(GetParam(), stated_error(file)));
  const double most = std::string(GetParam()) == "patch" ? 0 : 1e-6;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    for (std::uint32_t c = 0; c < channels_of(texture.get(), 0); ++c)
      ASSERT_NEAR(a[4 * q + c], b[4 * q + c], most * std::max(1.0f, std::abs(a[4 * q + c]))) << q;
  }
  expect_silent(*general);
}

// btfc_sample, in C++ over the CPU's decoder.
std::vector<float> cpu_sample(const btfc_texture* texture, std::uint32_t map, const ShaderSample& s, bool own,
                              bool linear, uint wrap) {
  const std::uint32_t width = btfc_texture_width(texture), height = btfc_texture_height(texture);
  const vec3 view = btfc_finite_direction(vec3(s.view[0], s.view[1], s.view[2])),
             light = btfc_finite_direction(vec3(s.light[0], s.light[1], s.light[2]));
  const float footprint = btfc_finite_footprint(s.footprint);
  const float x = btfc_place(s.uv[0], width, wrap), y = btfc_place(s.uv[1], height, wrap);
  const bool between = linear && footprint < 2;
  const uint taps = between ? 2u : own ? 1u : std::min(static_cast<uint>(std::ceil(footprint)), 4u);
  const std::uint32_t channels = channels_of(texture, map);
  std::vector<float> sum(channels);
  for (uint i = 0; i < taps * taps; ++i) {
    const float tx = static_cast<float>(i % taps), ty = static_cast<float>(i / taps);
    const float cx = x - 0.5f, cy = y - 0.5f, n = static_cast<float>(taps);
    const float ax = between ? std::floor(cx) + tx : x + ((tx + 0.5f) / n - 0.5f) * footprint;
    const float ay = between ? std::floor(cy) + ty : y + ((ty + 0.5f) / n - 0.5f) * footprint;
    const float weight =
        between ? std::abs(1 - tx - (cx - std::floor(cx))) * std::abs(1 - ty - (cy - std::floor(cy)))
                : 1 / (n * n);
    btfc_query q{btfc_place_texel(ax),     btfc_place_texel(ay),        map,      0,
                 {view.x, view.y, view.z}, {light.x, light.y, light.z}, footprint};
    const std::vector<float> value = cpu_values(texture, map, {&q, 1});
    for (std::uint32_t c = 0; c < channels; ++c) sum[c] += weight * value[c];
  }
  return sum;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

// Places in and far beyond the texture, and numbers that are none, quiet or signalling, in every argument.
std::vector<ShaderSample> odd_samples() {
  const float signalling = std::bit_cast<float>(0x7f800001u), negative = std::bit_cast<float>(0xffc00123u);
  const float odd[] = {0,     -0.0f,  1,    0.5f,       -0.25f,   1e-40f, 1e9f, -1e9f,
                       3e38f, -3e38f, kNan, signalling, negative, kInf,   -kInf};
  std::vector<ShaderSample> out;
  const ShaderSample plain{{0.4f, 0.7f}, {0.1f, 0.2f, 0.9f}, {-0.3f, 0.1f, 0.8f}, 1};
  for (const float v : odd) {
    for (int where = 0; where < 9; ++where) {
      ShaderSample s = plain;
      if (where < 2) s.uv[static_cast<std::size_t>(where)] = v;
      if (where >= 2 && where < 5) s.view[static_cast<std::size_t>(where - 2)] = v;
      if (where >= 5 && where < 8) s.light[static_cast<std::size_t>(where - 5)] = v;
      if (where == 8) s.footprint = v;
      out.push_back(s);
    }
    out.push_back({{v, v}, {v, v, v}, {v, v, v}, v});
  }
  return out;
}

bool finite_bits(float v) { return (std::bit_cast<std::uint32_t>(v) & 0x7f800000u) != 0x7f800000u; }

TEST_P(Shaders, SamplesAreFiniteWhateverTheBits) {
  const std::vector<ShaderSample> samples = odd_samples();
  const TexturePtr texture = load(file_of(vectors_of(GetParam()).back()));
  for (const ShaderStage stage : {ShaderStage::compute, ShaderStage::fragment}) {
    for (const bool linear : {false, true}) {
      VulkanOptions options;
      options.linear = linear;
      std::optional<VulkanDecoder> decoder = open_decoder(texture.get(), options);
      ASSERT_TRUE(decoder);
      const std::vector<float> values = values_of(decoder->samples(stage, 0, samples));
      for (std::size_t i = 0; i < samples.size(); ++i) {
        for (std::uint32_t c = 0; c < channels_of(texture.get(), 0); ++c)
          EXPECT_TRUE(finite_bits(values[4 * i + c])) << i << " " << c;
      }
      expect_silent(*decoder);
    }
  }
}

TEST_P(Shaders, SamplesAreTheCpusTexels) {
  const std::string model = GetParam();
  const Bytes file = file_of(vectors_of(GetParam()).front());
  const TexturePtr texture = load(file);
  const bool is_field = btfc_texture_unbounded(texture.get()) != 0, own = is_field || model == "gm";
  const Result<OpenedFile> opened = open_bytes(file);
  const uint wrap = is_field                              ? BTFC_UNBOUNDED
                    : opened->head.wrap_u == Wrap::repeat ? BTFC_REPEAT
                                                          : BTFC_CLAMP;
  std::mt19937 random(4);
  const auto number = [&](double from, double to) {
    return static_cast<float>(from + (to - from) * (static_cast<double>(random()) * 0x1p-32));
  };
  for (const bool linear : {false, true}) {
    if (linear && model == "gm") continue;  // evaluated between texels: no sum of texels
    VulkanOptions options;
    options.linear = linear;
    std::optional<VulkanDecoder> decoder = open_decoder(texture.get(), options);
    ASSERT_TRUE(decoder);
    std::vector<ShaderSample> samples;
    for (int i = 0; i < 60; ++i) {
      const double over = is_field ? 0 : 0.6;
      samples.push_back({{number(-over, 1 + over), number(-over, 1 + over)},
                         {number(-1, 1), number(-1, 1), number(-0.2, 1)},
                         {number(-1, 1), number(-1, 1), number(-0.2, 1)},
                         i % 3 == 0 ? number(1, 6) : 1});
    }
    const std::vector<float> values = values_of(decoder->samples(ShaderStage::fragment, 0, samples));
    const double most = 2 * std::max(shader_tolerance(model, stated_error(file)), 1e-5);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::vector<float> expected = cpu_sample(texture.get(), 0, samples[i], own, linear, wrap);
      for (std::size_t c = 0; c < expected.size(); ++c)
        EXPECT_NEAR(values[4 * i + c], expected[c], most * std::max(1.0f, std::abs(expected[c])))
            << i << " linear " << linear;
    }
    expect_silent(*decoder);
  }
}

// A mixture's value between texels is its own; at their centres it is that of the texels.
TEST_F(ShaderRunner, MixturesAreContinuous) {
  const TexturePtr texture = load(file_of(vectors_of("gm").front()));
  VulkanOptions options;
  options.linear = true;
  std::optional<VulkanDecoder> decoder = open_decoder(texture.get(), options);
  ASSERT_TRUE(decoder);
  const std::uint32_t width = btfc_texture_width(texture.get()), height = btfc_texture_height(texture.get());
  std::vector<ShaderSample> centres, between;
  std::vector<btfc_query> queries;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const std::uint32_t x = i % width, y = i * 7 % height;
    const std::array<float, 2> uv = {(static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                                     (static_cast<float>(y) + 0.5f) / static_cast<float>(height)};
    const std::array<float, 3> view = {0.3f, -0.1f, 0.9f}, light = {-0.2f, 0.5f, 0.7f};
    centres.push_back({uv, view, light, 1});
    between.push_back({{uv[0] + 0.3f / static_cast<float>(width), uv[1]}, view, light, 1});
    queries.push_back({static_cast<std::int32_t>(x),
                       static_cast<std::int32_t>(y),
                       0,
                       0,
                       {view[0], view[1], view[2]},
                       {light[0], light[1], light[2]},
                       1});
  }
  const std::vector<float> texels = cpu_values(texture.get(), 0, queries);
  const std::uint32_t channels = channels_of(texture.get(), 0);
  const auto off = [&](const std::vector<ShaderSample>& samples) {
    return difference(texels, values_of(decoder->samples(ShaderStage::compute, 0, samples)), channels).worst;
  };
  EXPECT_LE(off(centres), 1e-4);
  EXPECT_GT(off(between), 1e-4);  // not one value all over a texel
  expect_silent(*decoder);
}

// Robust mode: words that are noise, of any length, and parameters that are. Something finite, and no hang.
TEST_P(Shaders, RobustModeTakesAnyData) {
  const TexturePtr texture = load(file_of(vectors_of(GetParam()).front()));
  const Result<ShaderData> good = shader_data(texture.get());
  ASSERT_TRUE(good);
  VulkanOptions options;
  options.robust = true;
  options.baked = false;
  options.validation = validation_installed();
  const auto queries = random_queries(texture.get(), 0, {}, 64);
  std::mt19937 random(9);
  for (int round = 0; round < 6; ++round) {
    ShaderData data = *good;
    for (auto& words : data.words) {
      if (round >= 2) words.resize(random() % 3 == 0 ? 0 : words.size() / (1 + random() % 3));
      for (std::uint32_t& word : words) {
        if (round == 0 ? random() % 16 == 0 : round < 4) word = static_cast<std::uint32_t>(random());
      }
    }
    if (round >= 3) {
      for (std::uint32_t i = 4; i < 32; ++i) {
        if (random() % 2 == 0)
          data.params[0].words[i] = round == 5 ? 0 : static_cast<std::uint32_t>(random());
      }
    }
    Result<VulkanDecoder> opened = VulkanDecoder::open(data, options);
    ASSERT_TRUE(opened) << opened.error().message;
    VulkanDecoder& decoder = *opened;
    for (const float v : values_of(decoder.queries(ShaderStage::compute, 0, queries)))
      EXPECT_TRUE(finite_bits(v)) << round;
    expect_silent(decoder);
  }
  // And good data as they are.
  Result<VulkanDecoder> robust = VulkanDecoder::open(*good, options);
  ASSERT_TRUE(robust);
  if (btfc_texture_unbounded(texture.get()) != 0) return;  // nothing prepared
  const Difference d =
      difference(cpu_values(texture.get(), 0, queries),
                 values_of(robust->queries(ShaderStage::compute, 0, queries)), channels_of(texture.get(), 0));
  EXPECT_LE(d.worst, shader_tolerance(GetParam(), 0));
}

// Rows that are shared out over three slots: those of one slot.
TEST_F(ShaderRunner, RowsOverSeveralSlots) {
  const std::vector<std::filesystem::path> paths = vectors_of("ptm");
  for (const std::filesystem::path& path : paths) {
    const TexturePtr texture = load(file_of(path));
    Result<ShaderData> data = shader_data(texture.get());
    ASSERT_TRUE(data);
    constexpr std::size_t kRowsPerSlot = offsetof(PtmParams, rows_per_slot) / 4,
                          kPrecision = offsetof(PtmParams, precision_code) / 4,
                          kTerms = offsetof(PtmParams, terms) / 4,
                          kChannels = offsetof(PtmParams, all_channels) / 4;
    const std::uint32_t* p = data->params[0].words;
    if (p[kPrecision] != BTFC_F32 || btfc_texture_maps(texture.get()) > 1) continue;
    const std::size_t row = std::size_t{p[kTerms]} * p[kChannels], rows = data->words[1].size() / row;
    const std::size_t a_third = (rows + 2) / 3;
    const std::vector<std::uint32_t> whole = data->words[1];
    for (std::size_t slot = 1; slot < 4; ++slot) {
      const std::size_t begin = std::min((slot - 1) * a_third * row, whole.size()),
                        end = std::min(slot * a_third * row, whole.size());
      data->words[slot].assign(whole.begin() + static_cast<std::ptrdiff_t>(begin),
                               whole.begin() + static_cast<std::ptrdiff_t>(end));
    }
    data->params[0].words[kRowsPerSlot] = static_cast<std::uint32_t>(a_third);
    Result<VulkanDecoder> decoder = VulkanDecoder::open(*data, {});
    ASSERT_TRUE(decoder);
    const auto queries = random_queries(texture.get(), 0, {}, 1000);
    EXPECT_LE(difference(cpu_values(texture.get(), 0, queries),
                         values_of(decoder->queries(ShaderStage::compute, 0, queries)),
                         channels_of(texture.get(), 0))
                  .worst,
              1e-5);
    return;
  }
  FAIL() << "no vector of ptm in f32";
}

TEST_F(ShaderRunner, ImagesOfOneTexelAndOfNone) {
  const TexturePtr texture = load(encode("car", noise(12, 12, 1, SampleType::unorm8), {{"levels", "1"}}));
  ASSERT_NE(texture, nullptr);
  std::optional<VulkanDecoder> decoder = open_decoder(texture.get());
  const btfc_directions look{{0, 0, 1}, {0, 0, 1}, 1, 0};
  for (const ShaderStage stage : {ShaderStage::compute, ShaderStage::fragment}) {
    EXPECT_EQ(values_of(decoder->rectangle(stage, 0, look, 0, 0, 1, 1)).size(), 4u);
    EXPECT_TRUE(values_of(decoder->rectangle(stage, 0, look, 0, 0, 0, 5)).empty());
    EXPECT_TRUE(values_of(decoder->queries(stage, 0, {})).empty());
    EXPECT_TRUE(values_of(decoder->samples(stage, 0, {})).empty());
  }
  expect_silent(*decoder);
}

// A texture whose sides are one texel.
TEST_F(ShaderRunner, TextureOfOneTexel) {
  for (const char* model : {"pca", "lpca", "ptm", "plm", "pcarf", "gm"}) {
    for (const std::filesystem::path& path : vectors_of(model)) {
      if (path.stem() != "single") continue;
      const Bytes file = file_of(path);
      const TexturePtr texture = load(file);
      std::optional<VulkanDecoder> decoder = open_decoder(texture.get());
      const auto queries = random_queries(texture.get(), 0, {}, 100);
      EXPECT_LE(difference(cpu_values(texture.get(), 0, queries),
                           values_of(decoder->queries(ShaderStage::fragment, 0, queries)),
                           channels_of(texture.get(), 0))
                    .worst,
                shader_tolerance(model, 0))
          << path;
    }
  }
}

TEST(VulkanNeeds, WhatADeviceLacksIsSaid) {
  VulkanFacts full;
  full.name = "device";
  full.version = 1u << 22 | 1u << 12;
  full.graphics_and_compute = full.float_target = true;
  full.storage_bytes = std::uint64_t{1} << 27;
  full.storage_buffers = 4;
  full.push_bytes = 128;
  full.image_side = 4096;
  EXPECT_FALSE(missing_for(full, {}));
  const auto lacks = [&](auto change, const char* what) {
    VulkanFacts facts = full;
    change(facts);
    const auto missing = missing_for(facts, {});
    ASSERT_TRUE(missing) << what;
    EXPECT_NE(missing->find(what), std::string::npos) << *missing;
  };
  lacks([](VulkanFacts& f) { f.version = 1u << 22; }, "Vulkan 1.0");
  lacks([](VulkanFacts& f) { f.graphics_and_compute = false; }, "queue");
  lacks([](VulkanFacts& f) { f.storage_bytes -= 1; }, "134217727 bytes, expected 134217728");
  lacks([](VulkanFacts& f) { f.storage_buffers = 3; }, "3 storage buffers");
  lacks([](VulkanFacts& f) { f.push_bytes = 64; }, "64 bytes of push constants");
  lacks([](VulkanFacts& f) { f.image_side = 2048; }, "2048 texels");
  lacks([](VulkanFacts& f) { f.float_target = false; }, "32-bit floats");
}

// The page's code is that of the example, which the install test builds and runs.
TEST(GpuPlan, ThePagesCodeIsTheExamples) {
  const auto text_of = [](const std::string& path) {
    const Result<Bytes> bytes = read_file(path);
    EXPECT_TRUE(bytes) << path;
    return bytes ? std::string(bytes->begin(), bytes->end()) : std::string();
  };
  const auto between = [](const std::string& text, const std::string& begin, const std::string& end) {
    const std::size_t from = text.find(begin) + begin.size();
    return text.substr(from, text.find(end, from) - from);
  };
  const std::string page = text_of(BTFC_SPEC "/shaders.md"),
                    example = text_of(BTFC_SPEC "/../tests/consumer/frame.cpp");
  const std::string code = between(page, "```cpp\n", "```");
  EXPECT_GT(code.size(), 1000u);
  EXPECT_EQ(code, between(example, "// [texture]\n", "// [texture]\n"));
}

TEST(GpuPlan, SizesUploadsAndShaders) {
  for (const ModelFormat& model : models()) {
    const TexturePtr texture = load(file_of(vectors_of(model.name).front()));
    btfc_gpu_plan* plan = nullptr;
    btfc_error error;
    ASSERT_EQ(btfc_gpu_plan_new(texture.get(), nullptr, &plan, &error), BTFC_OK) << model.name;
    const btfc_gpu_plan_info& info = *btfc_gpu_plan_get(plan);
    EXPECT_EQ(info.model, static_cast<std::uint32_t>(model.id));
    EXPECT_EQ(info.map_count, btfc_texture_maps(texture.get()));
    EXPECT_EQ(info.pass_count, 0u);
    for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
      EXPECT_EQ(info.words_upload[slot], btfc_gpu_words_size(texture.get(), slot));
      EXPECT_EQ(info.words_size[slot], std::max<std::uint64_t>(info.words_upload[slot], 4));
    }
    for (std::uint32_t map = 0; map < info.map_count; ++map) {
      std::vector<std::uint32_t> params(btfc_gpu_params_size(texture.get(), map) / 4);
      ASSERT_LE(params.size(), std::size(info.params[map].words));
      btfc_gpu_write_params(texture.get(), map, params.data(), 4 * params.size());
      EXPECT_TRUE(std::equal(params.begin(), params.end(), info.params[map].words)) << model.name;
    }
    btfc_gpu_plan_free(plan);
    const btfc_gpu_window window{-20, 5, 100, 50}, huge{0, 0, 60000, 60000};
    ASSERT_EQ(btfc_gpu_plan_new(texture.get(), &window, &plan, &error), BTFC_OK);
    const btfc_gpu_plan_info& prepared = *btfc_gpu_plan_get(plan);
    EXPECT_EQ(prepared.pass_count > 0, btfc_texture_unbounded(texture.get()) != 0);
    for (std::uint32_t i = 0; i < prepared.pass_count; ++i) {
      std::size_t size = 0;
      EXPECT_NE(btfc_gpu_shader(prepared.passes[i].shader, &size), nullptr) << prepared.passes[i].shader;
      EXPECT_GT(size, 0u);
      EXPECT_LE(prepared.passes[i].push_size, 128u);
    }
    btfc_gpu_plan_free(plan);
    plan = nullptr;
    const btfc_result result = btfc_gpu_plan_new(texture.get(), &huge, &plan, &error);
    EXPECT_EQ(result, btfc_texture_unbounded(texture.get()) != 0 ? BTFC_LIMIT : BTFC_OK) << model.name;
    EXPECT_EQ(plan == nullptr, result != BTFC_OK);
    btfc_gpu_plan_free(plan);
  }
  std::size_t size = 1;
  EXPECT_EQ(btfc_gpu_shader("nothing.comp", &size), nullptr);
  EXPECT_EQ(size, 0u);
  btfc_gpu_plan_free(nullptr);
  EXPECT_EQ(btfc_gpu_plan_get(nullptr), nullptr);
}

}  // namespace
}  // namespace btfc::test
