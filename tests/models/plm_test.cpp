// Model plm: lobes and curves that it recovers, codebooks, what no parameters may do, sizes.
#include "shaders/models/plm.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "format/models/plm_payload.h"
#include "tests/models/reflectance_support.h"

namespace btfc::test {
namespace {

double lobe(double rho, const Vector3& a, double n, const Vector3& u) {
  const double base = a[0] * u[0] + a[1] * u[1] + a[2] * u[2];
  return base > 0 ? rho * std::pow(base, n) : 0;
}

// A lobe for every view, texel and channel; n from 0.6 to 7.
double lobes(std::size_t view, const Vector3& light, std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  const double tilt = 0.12 * static_cast<double>(view % 3) + 0.08 * x - 0.05 * c;
  const Vector3 a = {std::sin(tilt), 0.1 * y * std::cos(tilt), std::cos(tilt) * std::sqrt(1 - 0.01 * y * y)};
  return lobe(0.4 + 0.08 * y + 0.1 * c, a, 0.6 + 1.3 * x + 0.7 * c, light);
}

const OptionValues kLobesOnly = {{"polynomial", "none"}};

TEST(Plm, RecoversLobes) {
  const DatasetInfo info = small_info(5, 4, 2, 4, 40);
  const FitResult fitted = fit("plm", make_dataset(info, lobes), kLobesOnly);
  EXPECT_LT(reported(fitted, "lobe_rmse"), 1e-3);
  const Bytes file = pack(fitted);
  EXPECT_LT(worst_error(file, info, lobes), 8e-3);
  const TexturePtr texture = load(file);
  const Vector3 between = unit_vector(direction_from_degrees(33, 77));
  for (std::uint32_t c = 0; c < 2; ++c)
    EXPECT_NEAR(values_at(texture.get(), unit_vector(info.views[2]), between, 3, 1)[c],
                lobes(2, between, 3, 1, c), 8e-3);
}

TEST(Plm, StepsNeverMakeItWorse) {
  const DatasetInfo info = small_info(5, 4, 2, 3, 30);
  const Dataset dataset = make_dataset(info, lobes);
  double before = 1;
  for (const char* steps : {"1", "2", "4", "16"}) {
    const double now =
        reported(fit("plm", dataset, {{"polynomial", "none"}, {"iterations", steps}}), "lobe_rmse");
    EXPECT_LE(now, before * 1.0001) << steps;
    before = now;
  }
  EXPECT_LE(reported(fit("plm", dataset, kLobesOnly), "lobe_rmse"), before * 1.05);
}

// Values of a lobe through a curve: eq. 3 alone cannot give them, eq. 4 can.
double curved(std::size_t view, const Vector3& light, std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  const double v = lobes(view, light, x, y, c);
  return v > 0.35 ? 0.35 + 0.2 * (v - 0.35) : v;
}

TEST(Plm, PolynomialsOnlyHelp) {
  const DatasetInfo info = small_info(8, 6, 2, 2, 20);
  const Dataset dataset = make_dataset(info, curved);
  const FitResult alone = fit("plm", dataset, kLobesOnly);
  const FitResult matched = fit("plm", dataset, {{"polynomial", "histogram"}});
  const FitResult nearest = fit("plm", dataset, {{"polynomial", "least-squares"}});
  EXPECT_GT(reported(nearest, "polynomials_kept"), 0);
  EXPECT_LT(reported(nearest, "fit_rmse"), 0.8 * reported(alone, "fit_rmse"));
  EXPECT_LE(reported(matched, "fit_rmse"), reported(alone, "fit_rmse"));
  EXPECT_LE(reported(nearest, "fit_rmse"), 1.02 * reported(matched, "fit_rmse"));
  // What is reported is what a decoder gives.
  const TexturePtr texture = load(pack(nearest));
  double squares = 0;
  std::size_t count = 0;
  for (const DirectionPair& pair : info.pairs) {
    const Vector3 light = unit_vector(info.lights[pair.light]);
    for (std::int32_t i = 0; i < 48; ++i, count += 2) {
      const auto found = values_at(texture.get(), unit_vector(info.views[pair.view]), light, i % 8, i / 8);
      for (std::uint32_t c = 0; c < 2; ++c) {
        const double off = found[c] - curved(pair.view, light, static_cast<std::uint32_t>(i % 8),
                                             static_cast<std::uint32_t>(i / 8), c);
        squares += off * off;
      }
    }
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), reported(nearest, "fit_rmse"), 2e-5);
}

TEST(Plm, LevelZeroIsTheLobesAlone) {
  const DatasetInfo info = small_info(8, 6, 2, 2, 20);
  const Dataset dataset = make_dataset(info, curved);
  const Bytes with = pack(fit("plm", dataset, {})), without = pack(fit("plm", dataset, kLobesOnly));
  const auto value = [](const Bytes& file, std::uint32_t levels) {
    const Result<OpenedFile> opened = open_bytes(file);
    const ByteView bytes(file);
    const Result<LoadedItem> item = load_item(source_of(bytes), *opened, levels);
    PlmParams params;
    std::memcpy(&params, item->map_params[0].data(), sizeof params);
    const BtfcWords words{
        {item->words[0].data(), item->words[1].data(), item->words[2].data(), item->words[3].data()}};
    BtfcQuery query{};
    query.texel = {4, 3};
    query.view = {0.1f, 0, 1};
    query.light = {0.48f, 0.6f, 0.64f};
    return plm_eval(words, params, query)[1];
  };
  EXPECT_EQ(value(with, 0), value(without, kAllLevels));
  EXPECT_NE(value(with, 1), value(with, 0));
  EXPECT_EQ(value(with, 1), value(with, kAllLevels));
}

TEST(Plm, MissingPairsAndFewLights) {
  DatasetInfo info = small_info(3, 3, 2, 4, 40);
  std::erase_if(info.pairs,
                [](DirectionPair p) { return p.light > 0 && (p.light * 7 + p.view * 3) % 4 == 0; });
  EXPECT_LT(worst_error(pack(fit("plm", make_dataset(info, lobes), {})), info, lobes), 1e-2);
  for (const std::size_t lights : {1u, 2u, 3u}) {
    const DatasetInfo few = small_info(2, 2, 1, 1, lights);
    EXPECT_LT(worst_error(pack(fit("plm", make_dataset(few, lobes), {})), few, lobes), 1e-2) << lights;
  }
}

TEST(Plm, ConstantBlackSaturatedAndAHotTexel) {
  const DatasetInfo info = small_info(4, 3, 2, 2, 12);
  for (const char* precision : {"f32", "f16", "u8"}) {
    for (const double level : {0.0, 1.0, 0.25}) {
      const Reflectance flat = [&](auto&&...) { return level; };
      EXPECT_LT(
          worst_error(pack(fit("plm", make_dataset(info, flat), {{"precision", precision}})), info, flat),
          2e-2)
          << precision << level;
    }
    const Reflectance hot = [](std::size_t, const Vector3& light, std::uint32_t x, std::uint32_t y,
                               std::uint32_t) { return x == 2 && y == 1 ? light[2] : 0.0; };
    EXPECT_LT(worst_error(pack(fit("plm", make_dataset(info, hot), {{"precision", precision}})), info, hot),
              2e-2)
        << precision;
  }
}

TEST(Plm, BelowTheHorizonAndNoDirection) {
  const DatasetInfo info = small_info(2, 2, 1, 4, 20);
  const TexturePtr texture = load(pack(fit("plm", make_dataset(info, lobes), {})));
  const auto at = [&](const Vector3& view, const Vector3& light) {
    return values_at(texture.get(), view, light, 1, 0)[0];
  };
  const Vector3 normal{0, 0, 1};
  EXPECT_EQ(at(normal, {0.6, 0.8, -3}), at(normal, {0.6, 0.8, 0}));
  EXPECT_EQ(at(normal, {0, 0, 0}), at(normal, normal));
  EXPECT_EQ(at(normal, {NAN, 0, 1}), at(normal, normal));
  EXPECT_EQ(at({0.6, 0.8, -3}, normal), at({0.6, 0.8, 0}, normal));
}

// Four materials: four lobes are enough, two are not.
double materials(std::size_t, const Vector3& light, std::uint32_t x, std::uint32_t y, std::uint32_t) {
  const std::uint32_t kind = (x * 5 + y * 3) % 4;
  return lobe(0.2 + 0.2 * kind, {0.3 * kind / 3.0, 0, std::sqrt(1 - 0.09 * kind * kind / 9.0)}, 1 + kind,
              light);
}

TEST(Plm, Codebooks) {
  const DatasetInfo info = small_info(12, 9, 2, 2, 30);
  const Dataset dataset = make_dataset(info, materials);
  EXPECT_LT(reported(fit("plm", dataset, {{"polynomial", "none"}, {"clusters", "4"}}), "lobe_rmse"), 2e-3);
  EXPECT_GT(reported(fit("plm", dataset, {{"polynomial", "none"}, {"clusters", "2"}}), "lobe_rmse"), 2e-2);
  // More entries than there are different texels: clusters run empty.
  EXPECT_LT(reported(fit("plm", dataset, {{"polynomial", "none"}, {"clusters", "40"}, {"precision", "f16"}}),
                     "lobe_rmse"),
            4e-3);
  // More entries than texels: one each.
  const DatasetInfo tiny = small_info(3, 2, 1, 1, 30);
  const FitResult all = fit("plm", make_dataset(tiny, lobes), {{"polynomial", "none"}, {"clusters", "256"}});
  EXPECT_EQ(reported(all, "clusters"), 6);
  EXPECT_LT(reported(all, "lobe_rmse"), 2e-3);
  EXPECT_LT(worst_error(pack(fit("plm", dataset, {{"clusters", "4"}})), info, materials), 1e-2);
}

TEST(Plm, ThreadsMakeNoDifference) {
  const DatasetInfo info = small_info(9, 7, 3, 3, 15, SampleType::unorm8);
  const Dataset dataset = make_dataset(info, curved);
  for (const OptionValues& options : {OptionValues{{"precision", "u8"}}, OptionValues{{"clusters", "7"}}})
    EXPECT_EQ(pack(fit("plm", dataset, options, 1)), pack(fit("plm", dataset, options, 3)));
}

TEST(Plm, EntryBeyondTheCodebookIsRefused) {
  const DatasetInfo info = small_info(3, 3, 1, 1, 8);
  FitResult fitted = fit("plm", make_dataset(info, lobes), {{"clusters", "3"}});
  for (RawChunk& chunk : fitted.chunks) {
    if (type_name(chunk.key.type) == "INDX") chunk.raw[8] = 3;
  }
  const Result<Done> verified = verify_bytes(pack(fitted));
  ASSERT_FALSE(verified);
  EXPECT_STREQ(verified.error().rule, "PL4");
}

TEST(Plm, RulesOfTheFile) {
  const DatasetInfo info = small_info(3, 3, 1, 2, 8);
  const FitResult fitted = fit("plm", make_dataset(info, lobes), {});
  const auto rule_of = [&](const char* type, const std::function<void(Bytes&)>& edit) -> std::string {
    FitResult changed = fitted;
    for (RawChunk& chunk : changed.chunks) {
      if (type_name(chunk.key.type) == type) edit(chunk.raw);
    }
    const Result<Done> verified = verify_bytes(pack(changed));
    return verified ? "" : verified.error().rule;
  };
  EXPECT_EQ(rule_of("PARM", [](Bytes&) {}), "");
  for (const std::size_t at : {0u, 1u, 2u, 3u, 5u})
    EXPECT_EQ(rule_of("PARM", [&](Bytes& raw) { raw[at] = 3; }), "PL1") << at;
  EXPECT_EQ(rule_of("LOBE", [](Bytes& raw) { store_u32(&raw[4], 0x7fc00000); }), "PL3");
  EXPECT_EQ(rule_of("POLY", [](Bytes& raw) { store_u32(&raw[4], 0x50000000); }), "PL3");
}

// Whatever numbers within 2^32 a file holds, values are finite.
RC_GTEST_PROP(Plm, ValuesAreFinite, ()) {
  std::mt19937 random(*rc::gen::inRange(0u, 1u << 30));
  const auto number = [&] {
    const float scale = std::exp2(static_cast<float>(static_cast<int>(random() % 160) - 128));
    const float v = std::uniform_real_distribution<float>(-1, 1)(random) * scale;
    return random() % 8 == 0 ? std::copysign(4294967296.0f, v) : v;
  };
  const vec3 light = btfc_upper_unit({number(), number(), number()});
  const float y = btfc_lobe(number(), {number(), number(), number()}, number(), light);
  RC_ASSERT(std::abs(y) <= 65536.0f);
  RC_ASSERT(std::isfinite(btfc_lobe_polynomial(number(), number(), number(), number(), number(), y) * 3));
  RC_ASSERT(std::abs(light.x * light.x + light.y * light.y + light.z * light.z - 1) < 1e-6f);
}

TEST(Plm, ElementaryFunctions) {
  for (double x = 1e-12; x < 1e10; x *= 1.0007) {
    const auto f = static_cast<float>(x);
    EXPECT_NEAR(btfc_log2(f), std::log2(static_cast<double>(f)), 1e-6 + 1e-7 * std::fabs(std::log2(x)));
  }
  for (double x = -126; x < 126; x += 0.013) {
    const auto f = static_cast<float>(x);
    const double exact = std::exp2(static_cast<double>(f));
    EXPECT_NEAR(btfc_exp2(f), exact, 3e-7 * exact);
  }
  EXPECT_NEAR(btfc_lobe(2, {0, 0, 1}, 3, {0, 0.6f, 0.8f}), 2 * 0.512, 3e-6);
  EXPECT_EQ(btfc_lobe(2, {0, 0, 1}, 0, {0, 0.6f, 0.8f}), 2);
  EXPECT_EQ(btfc_lobe(2, {0, 0, -1}, 3, {0, 0.6f, 0.8f}), 0);
}

RC_GTEST_PROP(Plm, FormulaIsPayloadAndMemory, ()) {
  std::mt19937 random(*rc::gen::inRange(0u, 1u << 30));
  const auto [head, directions] = random_btf(ModelId::plm, random);
  const PlmShape shape{static_cast<Precision>(*rc::gen::inRange(0, 3)),
                       static_cast<Precision>(*rc::gen::inRange(0, 3)), *rc::gen::inRange(0, 2) == 0,
                       *rc::gen::inRange(0, 2) == 0 ? 0 : *rc::gen::inRange(1u, 257u)};
  const std::size_t texels = std::size_t{head.width} * head.height, channels = head.channels();
  PlmPayload payload;
  payload.directions = directions;
  for (std::uint32_t v = 0; v < head.views; ++v) {
    const std::size_t columns = shape.clusters > 0 ? shape.clusters : texels;
    payload.lobes.push_back(random_rows(random, 5 * channels, columns, shape.lobes));
    if (shape.clusters == 0) continue;
    std::vector<std::uint8_t> entries(channels * texels);
    for (std::uint8_t& entry : entries) entry = static_cast<std::uint8_t>(random() % shape.clusters);
    payload.entries.push_back(entries);
  }
  if (shape.polynomials) payload.terms = random_rows(random, 5 * channels, head.pairs, shape.terms);
  const std::vector<RawChunk> chunks = plm_write(head, shape, payload);
  check_sizes(head, chunks, plm_formula_bits(head, shape), plm_memory_bits(head, shape));
  check_fast_rows(chunks);
  RC_ASSERT(!testing::Test::HasFailure());
}

TEST(Plm, SizesOfTheSurvey) {
  const ModelFormat& model = *find_model("plm");
  const auto layout = [&](const OptionValues& options) {
    const Result<ItemDescription> item = model.describe(options);
    return item ? model.layout(item->head, item->parm) : Result<Layout>(item.error());
  };
  const Result<Layout> wool = layout({{"size", "25x25"}});
  ASSERT_TRUE(wool);
  EXPECT_EQ(wool->paper->bits, 32u * 857790u);
  EXPECT_EQ(wool->formula_bits, 32u * 857790u + 64u);
  // Fig. 13: a byte a texel and channel, and 256 lobes a view and channel.
  const Result<Layout> books =
      layout({{"size", "122x125"}, {"clusters", "256"}, {"precision", "u8"}, {"polynomial", "none"}});
  ASSERT_TRUE(books);
  EXPECT_EQ(books->formula_bits, 8 * (8 + 81 * (std::uint64_t{8} * 15 + 15 * 256 + (3 * 15250 + 2))));
  EXPECT_EQ(books->paper->bits, 32 * 15 * (std::uint64_t{15250} * 81 + 6561));
  EXPECT_TRUE(layout({{"size", "256x256"}}));
  EXPECT_FALSE(layout({{"size", "290x290"}}));
  const Result<Layout> beyond =
      layout({{"size", "65536x65536"}, {"views", "1024"}, {"lights", "1024"}, {"clusters", "256"}});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().status, Status::bad_argument);
  EXPECT_FALSE(layout({{"size", "2x2"}, {"clusters", "257"}}));
}

}  // namespace
}  // namespace btfc::test
