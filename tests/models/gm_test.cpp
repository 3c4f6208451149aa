// Model gm as files: sizes, levels, extremes, footprints, fast paths against the reference.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "encoder/split_mix.h"
#include "format/models/gm_payload.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

Layout layout_of(const OptionValues& options) {
  const Result<ItemDescription> item = gm_describe(options);
  EXPECT_TRUE(item) << item.error().message;
  return *gm_layout(item->head, item->parm);
}

TEST(GmModel, CountsAreThePapers) {
  const OptionValues paper = {{"size", "256x256"}, {"components", "500"}, {"layout", "paper"}};
  const auto with = [&](const char* mean) {
    OptionValues options = paper;
    options["mean-brdf"] = mean;
    return layout_of(options);
  };
  const Layout wide = with("f32"), narrow = with("u8");
  EXPECT_EQ(wide.paper->bits, 917856u);
  EXPECT_EQ(narrow.paper->bits, 445464u);
  EXPECT_EQ(wide.paper->counts.back().value, "44972.5");
  EXPECT_EQ(narrow.paper->counts.back().value, "23165.9");
  // What is stored: the weights and PARM too.
  EXPECT_EQ(wide.formula_bits, 917856u + 32 * 500 + 128);
  EXPECT_EQ(narrow.formula_bits, 445464u + 32 * 500 + 128);
}

// A valid payload of random shape and contents.
struct RandomGm {
  Head head;
  GmParm parm;
  std::vector<RawChunk> chunks;
};
RandomGm random_gm(std::mt19937& random) {
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(low + (high - low) * below(100001) / 100000.0);
  };
  RandomGm out;
  RandomBtf btf = random_btf(ModelId::gm, random);
  Head& head = out.head = btf.head;
  while (head.channels() > 4) head.maps.pop_back();
  if (head.maps.empty()) head.maps = {Map{}};
  if (below(4) == 0) head.value_transform = ValueTransform::log;
  GmParm& p = out.parm;
  p.components = 1 + below(40);
  p.gates = below(3) == 0 ? 1 + below(32) : 0;
  p.layout = static_cast<GmLayout>(below(4) == 0);
  const bool paper = p.layout == GmLayout::paper;
  p.levels = paper ? 1 : 1 + below(std::bit_width(p.components));
  p.precision = paper ? Precision::f32 : static_cast<Precision>(below(3));
  p.mean = static_cast<GmMeanForm>(below(paper ? 2 : 3));
  p.mean_rank = p.mean == GmMeanForm::coded ? 1 + below(4) : 0;
  p.shear = !paper && below(2) == 1;
  p.onion = static_cast<GmOnion>(below(3) == 0);

  const std::uint32_t channels = head.channels(), rows = p.rows(head), dims = kGmInputs + channels;
  std::vector<float> values(std::size_t{rows} * p.components);
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t m = 0; m < p.components; ++m) {
      float& v = values[std::size_t{r} * p.components + m];
      if (r < kGmInputs) {
        v = r < 2 ? uniform(-2, 14) : uniform(-1.5, 1.5);
      } else if (paper) {
        v = r < dims ? uniform(-0.5, 0.5) : r < dims + kGmInputs ? uniform(0.2, 4) : uniform(0, 1);
      } else {
        v = r < kGmHeightRow ? uniform(-1.5, 3) : r == kGmHeightRow ? uniform(-4, 4) : uniform(-0.5, 0.5);
      }
    }
  }
  GmPayload payload{btf.directions, code_rows(values, rows, p.components, p.precision), {}};
  GmMean& mean = payload.mean;
  mean.form = p.mean;
  mean.views = head.views;
  mean.lights = head.lights;
  mean.pairs = head.pairs;
  mean.channels = channels;
  mean.rank = p.mean_rank;
  if (p.mean == GmMeanForm::coded) {
    for (std::uint32_t k = 0; k < mean.rank; ++k) mean.steps.push_back(uniform(0, 1e-4));
    for (std::uint32_t i = 0; i < mean.rank * mean.views; ++i)
      mean.view_codes.push_back(static_cast<std::int8_t>(below(256)));
    for (std::uint32_t i = 0; i < mean.rank * mean.lights * channels; ++i)
      mean.light_codes.push_back(static_cast<std::int8_t>(below(256)));
  } else {
    for (std::uint32_t i = 0; i < mean.pairs * channels; ++i)
      mean.table.push_back(static_cast<float>(below(256)) / 255.0f);
  }
  out.chunks = gm_write(head, p, payload);
  return out;
}

RC_GTEST_PROP(GmFiles, FormulaPayloadFileAndMemoryAgree, ()) {
  std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
  const RandomGm made = random_gm(random);
  check_sizes(made.head, made.chunks, gm_formula_bits(made.head, made.parm),
              gm_memory_bits(made.head, made.parm));
  RC_ASSERT(!testing::Test::HasFailure());
}

btfc_query query_at(std::uint32_t map, std::int32_t x, std::int32_t y, const Vector3& view,
                    const Vector3& light) {
  btfc_query q{};
  q.map = map;
  q.x = x;
  q.y = y;
  for (std::size_t i = 0; i < 3; ++i) {
    q.view[i] = static_cast<float>(view[i]);
    q.light[i] = static_cast<float>(light[i]);
  }
  return q;
}

Vector3 random_direction(SplitMix64& random) {
  const double z = random.uniform(), phi = 2 * std::numbers::pi * random.uniform(), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// The answers of one call, which the fast path gives, and of as many calls, which the reference gives.
void expect_batches_agree(const btfc_texture* texture, const std::vector<btfc_query>& queries,
                          double tolerance, std::size_t allowed) {
  std::vector<float> together(queries.size() * 4), alone(together.size());
  ASSERT_EQ(
      btfc_eval(texture, nullptr, queries.data(), sizeof(btfc_query), queries.size(), together.data(), 4),
      BTFC_OK);
  for (std::size_t q = 0; q < queries.size(); ++q)
    ASSERT_EQ(btfc_eval(texture, nullptr, &queries[q], sizeof(btfc_query), 1, &alone[4 * q], 4), BTFC_OK);
  std::size_t off = 0;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    btfc_map_info info{};
    btfc_texture_map_info(texture, queries[q].map, &info);
    bool differs = false;
    for (std::uint32_t c = 0; c < info.channels; ++c) {
      ASSERT_TRUE(std::isfinite(together[4 * q + c]));
      const double limit = tolerance * std::max(1.0, std::fabs(static_cast<double>(alone[4 * q + c])));
      differs |= std::fabs(together[4 * q + c] - alone[4 * q + c]) > limit;
    }
    off += differs;
  }
  EXPECT_LE(off, allowed);
}

// Rectangles and batches against the reference, over random files. Gates that all but tie may differ.
TEST(GmFiles, FastPathsAgainstTheReference) {
  std::mt19937 random(4);
  SplitMix64 draw(5);
  for (int file = 0; file < 40; ++file) {
    const RandomGm made = random_gm(random);
    const Result<Bytes> bytes = pack_file(made.chunks);
    ASSERT_TRUE(bytes);
    const TexturePtr t = load(*bytes);
    ASSERT_TRUE(t);
    std::vector<btfc_query> queries;
    for (int i = 0; i < 400; ++i) {
      const auto map = draw.below(btfc_texture_maps(t.get()));
      queries.push_back(query_at(map, static_cast<int>(draw.below(40)) - 14,
                                 static_cast<int>(draw.below(40)) - 14, random_direction(draw),
                                 random_direction(draw)));
    }
    expect_batches_agree(t.get(), queries, 1e-4, made.parm.gates > 0 ? 4 : 0);

    const std::uint32_t w = made.head.width, h = made.head.height;
    for (const float footprint : {0.0f, 3.0f}) {
      btfc_directions d{{0.3f, -0.1f, 0.5f}, {-0.2f, 0.6f, 0.4f}, footprint, 0};
      btfc_map_info info{};
      btfc_texture_map_info(t.get(), 0, &info);
      std::vector<float> fast(std::size_t{w} * h * info.channels), plain(fast.size());
      ASSERT_EQ(btfc_decode_rect(t.get(), nullptr, 0, &d, 0, 0, w, h, BTFC_FLOAT32, fast.data(),
                                 w * info.channels * 4, fast.size() * 4),
                BTFC_OK);
      std::vector<std::int32_t> at;
      for (std::uint32_t i = 0; i < w * h; ++i)
        at.insert(at.end(), {static_cast<std::int32_t>(i % w), static_cast<std::int32_t>(i / w)});
      ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, 0, &d, at.data(), at.size() / 2, BTFC_FLOAT32,
                                   plain.data(), plain.size() * 4),
                BTFC_OK);
      std::size_t off = 0;
      for (std::size_t i = 0; i < fast.size(); ++i)
        off += std::fabs(fast[i] - plain[i]) > 1e-4f * std::max(1.0f, std::fabs(plain[i]));
      EXPECT_LE(off, made.parm.gates > 0 ? 6u : 0u) << file;
    }
  }
}

Bytes encode_gm(const Dataset& set, OptionValues options, unsigned threads = 1) {
  options.emplace("iterations", options.contains("fit") ? "8" : "1500");
  return encode("gm", set, options, Codec::raw, threads);
}

// Stripes that the light crosses: smooth over places and directions, as a mixture is.
double stripes(const Direction& view, const Direction& light, std::uint32_t x, std::uint32_t y,
               std::uint32_t channel) {
  const Vector3 v = unit_vector(view), l = unit_vector(light);
  const double wave = std::sin(2 * std::numbers::pi * (x + 2.0 * v[0]) / 12);
  return std::clamp(0.4 + 0.25 * wave * (0.5 + l[1]) + 0.1 * l[2] + 0.01 * y + 0.05 * channel, 0.0, 1.0);
}

Dataset small_set() { return make_btf(btf_info(12, 11, 3, SampleType::unorm8, rings(2), rings(2)), stripes); }

TEST(GmModel, BothFitsLayoutsPrecisionsAndMeans) {
  const Dataset set = small_set();
  double mean_only = 0;
  {
    const Dataset flat = small_set();
    mean_only = rmse(flat, encode_gm(flat, {{"components", "1"}, {"mean-brdf", "f32"}}));
  }
  for (const OptionValues& options :
       {OptionValues{{"precision", "f32"}}, OptionValues{{"precision", "f16"}}, OptionValues{},
        OptionValues{{"gates", "4"}}, OptionValues{{"shear", "off"}}, OptionValues{{"mean-brdf", "u8"}},
        OptionValues{{"layout", "paper"}}, OptionValues{{"levels", "1"}}, OptionValues{{"onion", "printed"}},
        OptionValues{{"fit", "em"}},
        OptionValues{{"fit", "em"}, {"layout", "paper"}, {"mean-brdf", "f32"}}}) {
    OptionValues all = options;
    all.emplace("components", "60");
    // The folded angles take more steps to the same bound.
    if (!options.contains("fit") && !options.contains("onion")) all.emplace("iterations", "600");
    const Bytes file = encode_gm(set, all);
    EXPECT_TRUE(verify_bytes(file));
    EXPECT_LT(rmse(set, file), mean_only * (options.contains("fit") ? 0.4 : 0.1))
        << testing::PrintToString(options);
  }
}

TEST(GmModel, LevelsArePrefixes) {
  const Dataset set = small_set();
  const Bytes file = encode_gm(set, {{"components", "64"}, {"levels", "4"}});
  const auto error = [&](std::uint32_t levels) {
    const btfc_selection selection{sizeof(btfc_selection), levels, 0, 0, 0, 0};
    return rmse(set, file, &selection);
  };
  EXPECT_LT(error(4), 0.5 * error(1));
  EXPECT_EQ(error(4), rmse(set, file)) << "all there are";
}

// All texels of the first map under an oblique pair.
std::vector<float> values_with(const Bytes& file, std::uint32_t gates, float culling) {
  btfc_reader* reader = nullptr;
  btfc_texture* loaded = nullptr;
  btfc_error error{};
  EXPECT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, &error), BTFC_OK);
  const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
  const btfc_selection selection{sizeof(btfc_selection), 0, 0, 0, gates, culling};
  if (btfc_texture_load(reader, &selection, &loaded, &error) != BTFC_OK) return {};
  const TexturePtr texture(loaded);
  const std::uint32_t width = btfc_texture_width(loaded), height = btfc_texture_height(loaded);
  std::vector<float> values(std::size_t{width} * height * 3);
  const btfc_directions d{{0.3f, 0.1f, 0.9f}, {-0.4f, 0.2f, 0.8f}, 1, 0};
  EXPECT_EQ(btfc_decode_rect(loaded, nullptr, 0, &d, 0, 0, width, height, BTFC_FLOAT32, values.data(),
                             width * 12, values.size() * 4),
            BTFC_OK);
  return values;
}

TEST(GmModel, GatesAreChosenAtLoading) {
  FitResult result = fit("gm", small_set(), {{"components", "40"}, {"iterations", "200"}});
  const Bytes all = pack(result);
  for (RawChunk& chunk : result.chunks) {
    if (chunk.key.type == kParm) store_u16(&chunk.raw[4], 4);
  }
  const Bytes four = pack(result);
  EXPECT_EQ(values_with(all, 4, 0), values_with(four, 0, 0));
  EXPECT_NE(values_with(all, 4, 0), values_with(all, 0, 0));
  EXPECT_NE(values_with(four, 2, 0), values_with(four, 0, 0));
  EXPECT_TRUE(values_with(four, 5, 0).empty()) << "more than the file has";
  EXPECT_TRUE(values_with(all, 33, 0).empty());
}

TEST(GmModel, CullingMovesValuesByItsShareAtMost) {
  const Bytes file = encode_gm(small_set(), {{"components", "60"}, {"iterations", "200"}});
  const std::vector<float> exact = values_with(file, 0, 0), rough = values_with(file, 0, 0.05f);
  float most = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) most = std::max(most, std::abs(exact[i] - rough[i]));
  EXPECT_GT(most, 0.0f);
  EXPECT_LT(most, 0.05f) << "of outputs within a range of 1";
  EXPECT_TRUE(values_with(file, 0, 0.2f).empty());
}

TEST(GmModel, SameFileOnAnyNumberOfThreads) {
  const Dataset set = small_set();
  for (const char* fit : {"refined", "em"}) {
    const OptionValues options = {{"components", "24"}, {"fit", fit}, {"iterations", "20"}};
    const Bytes one = encode_gm(set, options, 1);
    EXPECT_EQ(one, encode_gm(set, options, 2));
    EXPECT_EQ(one, encode_gm(set, options, 7));
  }
}

TEST(GmModel, BytesCostAndPsnrChooseTheComponents) {
  const Dataset set = small_set();
  const auto info_of = [](const Bytes& file) {
    const Result<OpenedFile> opened = open_bytes(file);
    EXPECT_TRUE(opened);
    return *opened;
  };
  for (const std::uint64_t bytes : {300u, 1000u, 2500u}) {
    const OpenedFile file = info_of(encode_gm(set, {{"bytes", std::to_string(bytes)}, {"iterations", "20"}}));
    EXPECT_LE(file.layout.formula_bits, 8 * bytes);
    EXPECT_GT(file.layout.formula_bits, 8 * (bytes - 40)) << "another component would fit";
  }
  for (const std::uint64_t cost : {600u, 3000u}) {
    const OpenedFile file =
        info_of(encode_gm(set, {{"decode-cost", std::to_string(cost)}, {"iterations", "20"}}));
    EXPECT_LE(file.layout.cost->operations, cost);
    EXPECT_GT(file.layout.cost->operations, cost - 100);
  }
  const FitResult found = fit("gm", set, {{"psnr", "19"}, {"iterations", "1500"}});
  for (const Parameter& p : found.report) {
    if (p.name == "psnr_db") {
      EXPECT_GE(std::stod(p.value), 19);
    }
  }
}

// Values that no 8-bit set has: half floats to 65,504 by the logarithm, one texel 10^4 times the mean.
TEST(GmModel, HighDynamicRange) {
  const Value hdr = [](const Direction& v, const Direction& l, std::uint32_t x, std::uint32_t y,
                       std::uint32_t c) {
    if (x == 3 && y == 4) return 65504.0;
    return std::exp2(14 * stripes(v, l, x, y, c) - 6);
  };
  const Dataset set = make_btf(btf_info(10, 9, 3, SampleType::float16, rings(2), rings(2)), hdr);
  const Bytes file = encode_gm(set, {{"components", "80"}, {"precision", "f32"}});
  EXPECT_EQ(open_bytes(file)->head.value_transform, ValueTransform::log);
  EXPECT_TRUE(std::isfinite(rmse(set, file)));
  // Logarithms are near where the values range over six decades.
  const TexturePtr t = load(file);
  double sum = 0;
  std::size_t count = 0;
  for (std::uint32_t p = 0; p < set.info().pairs.size(); p += 5) {
    const Vector3 view = unit_vector(set.info().views[set.info().pairs[p].view]),
                  light = unit_vector(set.info().lights[set.info().pairs[p].light]);
    for (std::uint32_t x = 0; x < 10; ++x) {
      const btfc_query q = query_at(0, static_cast<int>(x), 4, view, light);
      float value[4];
      ASSERT_EQ(btfc_eval(t.get(), nullptr, &q, sizeof q, 1, value, 4), BTFC_OK);
      const double wanted = x == 3 ? 65504.0
                                   : hdr(set.info().views[set.info().pairs[p].view],
                                         set.info().lights[set.info().pairs[p].light], x, 4, 0);
      const double off = std::log1p(std::max(0.0f, value[0])) - std::log1p(wanted);
      sum += off * off;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(count)), 1.5) << "of 11";
}

TEST(GmModel, ExtremesDecodeFinitely) {
  const auto constant = [](double v) {
    return [v](const Direction&, const Direction&, std::uint32_t, std::uint32_t, std::uint32_t) { return v; };
  };
  for (const char* components : {"1", "2", "40"}) {
    for (const char* fit : {"refined", "em"}) {
      const OptionValues options = {
          {"components", components}, {"fit", fit}, {"iterations", "30"}, {"mean-rank", "2"}};
      for (const double v : {0.0, 0.4, 1.0}) {
        const Dataset set = make_btf(btf_info(6, 5, 3, SampleType::unorm8, rings(1), rings(1)), constant(v));
        EXPECT_LT(rmse(set, encode_gm(set, options)), 0.02) << v;
      }
      const Dataset one = make_btf(btf_info(6, 5, 3, SampleType::unorm16, rings(0), rings(0)), bumpy);
      EXPECT_LT(rmse(one, encode_gm(one, options)), 0.15) << "one pair";
      const Dataset texel = make_btf(btf_info(1, 1, 1, SampleType::unorm8, rings(1), rings(1)), bumpy);
      EXPECT_LT(rmse(texel, encode_gm(texel, options)), 0.02) << "one texel";
    }
  }
}

TEST(GmModel, MissingPairs) {
  DatasetInfo info = btf_info(6, 6, 3, SampleType::unorm16, rings(2), rings(2));
  std::mt19937 random(8);
  std::erase_if(info.pairs, [&](const DirectionPair& p) { return p.light != p.view && random() % 2 == 0; });
  const Dataset set = make_btf(info, bumpy);
  for (const char* mean : {"coded", "f32"}) {
    const Bytes file = encode_gm(set, {{"components", "50"}, {"mean-brdf", mean}});
    EXPECT_TRUE(verify_bytes(file));
    EXPECT_LT(rmse(set, file), 0.05);
  }
}

// Places wrap, directions of any length and below the horizon are taken, azimuths have no seam.
TEST(GmModel, QueriesFromAnywhere) {
  DatasetInfo info = btf_info(12, 11, 3, SampleType::unorm8, rings(3), rings(3));
  info.wraps = true;
  const Dataset set = make_btf(info, bumpy);
  const TexturePtr t = load(encode_gm(set, {{"components", "50"}}));
  const float view[3] = {0.3f, 0.1f, 0.6f}, light[3] = {-0.5f, 0.2f, 0.3f};
  const auto at = [&](int x, int y) { return value_at(t.get(), x, y, view, light); };
  EXPECT_EQ(at(3, 4), at(3 + 12, 4 - 22));
  const float below[3] = {0.5f, 0.1f, -0.4f}, horizon[3] = {0.5f, 0.1f, 0}, longer[3] = {5e6f, 1e6f, 0};
  EXPECT_EQ(value_at(t.get(), 1, 1, below, below), value_at(t.get(), 1, 1, horizon, horizon));
  EXPECT_NEAR(value_at(t.get(), 1, 1, longer, light)[0], value_at(t.get(), 1, 1, horizon, light)[0], 1e-4);
  const float none[3] = {0, 0, 0}, pole[3] = {0, 0, 1}, huge[3] = {1e30f, 1e30f, 1e30f};
  EXPECT_EQ(value_at(t.get(), 1, 1, none, none), value_at(t.get(), 1, 1, pole, pole));
  EXPECT_EQ(value_at(t.get(), 1, 1, huge, huge), value_at(t.get(), 1, 1, pole, pole));
  const float before[3] = {0.6f, -1e-6f, 0.8f}, after[3] = {0.6f, 1e-6f, 0.8f};
  EXPECT_NEAR(value_at(t.get(), 5, 5, before, light)[1], value_at(t.get(), 5, 5, after, light)[1], 1e-4);
}

// Far away nothing but the mean BRDF is left, and growing footprints come nearer to it.
TEST(GmModel, FootprintsEndAtTheMean) {
  const Dataset set = small_set();
  const TexturePtr t = load(encode_gm(set, {{"components", "50"}, {"mean-brdf", "f32"}}));
  double before = 1;
  for (const float footprint : {1.0f, 4.0f, 16.0f, 200.0f}) {
    double sum = 0;
    for (std::uint32_t p = 0; p < set.info().pairs.size(); p += 7) {
      double mean[3] = {};
      for (std::uint32_t i = 0; i < 12 * 11 * 3; ++i)
        mean[i % 3] += set.code(p, i / 3 % 12, i / 36, i % 3) / 255.0 / (12 * 11);
      for (int i = 0; i < 12; ++i) {
        btfc_query q = query_at(0, i, i % 11, unit_vector(set.info().views[set.info().pairs[p].view]),
                                unit_vector(set.info().lights[set.info().pairs[p].light]));
        q.footprint = footprint;
        float value[4];
        ASSERT_EQ(btfc_eval(t.get(), nullptr, &q, sizeof q, 1, value, 4), BTFC_OK);
        for (int c = 0; c < 3; ++c) sum += std::fabs(value[c] - mean[c]);
      }
    }
    const double off = sum / (36.0 * static_cast<double>((set.info().pairs.size() + 6) / 7));
    EXPECT_LT(off, before) << footprint;
    before = off;
  }
  EXPECT_LT(before, 0.002);
}

}  // namespace
}  // namespace btfc::test
