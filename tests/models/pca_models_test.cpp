// Models pca, pcarf and lpca: sizes, exact recovery, extremes, levels, fast rows.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "encoder/models/lpca_clusters.h"
#include "format/models/lpca_payload.h"
#include "format/models/pca_payload.h"
#include "format/models/pcarf_payload.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

constexpr const char* kModels[] = {"pca", "pcarf", "lpca"};

const ModelFormat& format_of(const char* model) { return *find_model(model); }

Layout layout_of(const char* model, const OptionValues& options) {
  const Result<ItemDescription> item = format_of(model).describe(options);
  EXPECT_TRUE(item) << item.error().message;
  return *format_of(model).layout(item->head, item->parm);
}

std::string count_of(const Layout& layout, const std::string& name) {
  for (const Parameter& p : layout.paper->counts) {
    if (p.name == name) return p.value;
  }
  return "none";
}

// Table 6 of the survey for knitted wool, and the ratios of its Table 7.
TEST(PcaModels, CountsAreTheSurveys) {
  const OptionValues wool = {{"size", "25x25"}};
  const auto with = [&](OptionValues more) {
    more.insert(wool.begin(), wool.end());
    return more;
  };
  const Layout pca = layout_of("pca", with({{"rank", "61"}}));
  EXPECT_EQ(count_of(pca, "tile_values"), "12301875");
  EXPECT_EQ(count_of(pca, "values"), "516471");
  EXPECT_EQ(pca.paper->bits, 32 * 516471u);
  EXPECT_EQ(count_of(layout_of("pcarf", with({{"rank", "6"}})), "values"), "1102491");
  const Layout lpca = layout_of("lpca", with({{"clusters", "3"}, {"rank", "21"}}));
  EXPECT_EQ(count_of(lpca, "values"), "1299703");
  EXPECT_EQ(count_of(lpca, "values_with_weights"), "1312828");
  struct Row {
    const char *size, *clusters, *rank;
    double ratio;
  };
  for (const Row& row :
       {Row{"25x25", "3", "21", 9.37}, Row{"21x23", "2", "21", 10.84}, Row{"19x23", "2", "13", 15.44},
        Row{"74x79", "6", "29", 30.95}, Row{"86x87", "8", "18", 46.99}, Row{"137x142", "19", "14", 64.88}}) {
    const Layout l = layout_of("lpca", {{"size", row.size}, {"clusters", row.clusters}, {"rank", row.rank}});
    EXPECT_NEAR(std::stod(count_of(l, "ratio_with_weights")), row.ratio, 0.005) << row.size;
  }
}

// Random parameters and contents: formula == payload == what a file holds, and what is loaded takes
// memory_bits; the fast rows and the reference give the same bits.
void check_random_file(const char* model, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto [head, d] = random_btf(format_of(model).id, random);
  const auto texels = static_cast<Precision>(random() % 3), tables = static_cast<Precision>(random() % 3);
  const auto rank = static_cast<std::uint32_t>(random() % 6),
             clusters = static_cast<std::uint32_t>(1 + random() % 4);
  const std::uint64_t n = head.texels(), s = head.channels();
  const auto rows = [&](std::uint64_t r, std::uint64_t c, Precision p) {
    return random_rows(random, r, c, p);
  };

  std::vector<RawChunk> chunks;
  std::uint64_t formula = 0, memory = 0;
  if (std::string(model) != "lpca") {
    const WeightedModel& kind = std::string(model) == "pca" ? kPcaModel : kPcarfModel;
    const WeightedShape shape{rank, texels, tables};
    WeightedImages p{d, {}, {}, {}};
    for (std::uint32_t v = 0; v < kind.sets(head); ++v) p.means.push_back(rows(s, n, texels));
    for (std::uint32_t k = 0; k < rank; ++k) {
      p.images.emplace_back();
      for (std::uint32_t v = 0; v < kind.sets(head); ++v) p.images.back().push_back(rows(s, n, texels));
      p.weights.push_back(rows(1, head.pairs, tables));
    }
    chunks = weighted_write(kind, head, shape, p);
    formula = weighted_formula_bits(kind, head, shape);
    memory = weighted_memory_bits(kind, head, shape);
  } else {
    const LpcaShape shape{clusters, rank, texels, tables};
    LpcaPayload p{d, {}, rows(clusters * s, head.pairs, tables), {}, {}};
    for (std::uint64_t t = 0; t < n; ++t)
      p.cluster.push_back(static_cast<std::uint16_t>(random() % clusters));
    for (std::uint32_t k = 0; k < rank; ++k) {
      p.vectors.push_back(rows(clusters * s, head.pairs, tables));
      p.weights.push_back(rows(1, n, texels));
    }
    chunks = lpca_write(head, shape, p);
    formula = lpca_formula_bits(head, shape);
    memory = lpca_memory_bits(head, shape);
  }
  check_sizes(head, chunks, formula, memory);
  check_fast_rows(chunks);
}

RC_GTEST_PROP(PcaSizes, FormulaPayloadFileAndMemoryAgree, ()) {
  check_random_file("pca", *rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(!testing::Test::HasFailure());
}
RC_GTEST_PROP(PcarfSizes, FormulaPayloadFileAndMemoryAgree, ()) {
  check_random_file("pcarf", *rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(!testing::Test::HasFailure());
}
RC_GTEST_PROP(LpcaSizes, FormulaPayloadFileAndMemoryAgree, ()) {
  check_random_file("lpca", *rc::gen::arbitrary<std::uint32_t>());
  RC_ASSERT(!testing::Test::HasFailure());
}

class PcaModel : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, PcaModel, testing::ValuesIn(kModels),
                         [](const auto& test) { return std::string(test.param); });

// Enough components for anything: half floats of the original come back.
TEST_P(PcaModel, FullRankIsExact) {
  const Dataset set = make_btf(btf_info(5, 4, 3, SampleType::float16, rings(1), rings(2)), bumpy);
  EXPECT_LT(rmse(set, encode(GetParam(), set, {{"rank", "255"}, {"clusters", "1"}})), 1e-5);
  const Dataset many = make_btf(btf_info(3, 2, 6, SampleType::unorm16, rings(1), rings(1)), bumpy);
  EXPECT_LT(rmse(many, encode(GetParam(), many, {{"rank", "255"}, {"clusters", "2"}})), 1e-5);
}

// Each component helps; prefixes of a file are the files of lower rank; precisions cost little.
TEST_P(PcaModel, ComponentsLevelsAndPrecisions) {
  const Dataset set = make_btf(btf_info(12, 11, 3, SampleType::unorm8, rings(2), rings(2)), bumpy);
  double before = 1;
  const Bytes whole = encode(GetParam(), set, {{"rank", "6"}, {"clusters", "3"}});
  for (std::uint32_t rank = 0; rank <= 6; ++rank) {
    const btfc_selection selection{sizeof(btfc_selection), rank + 1, 0, 0, 0, 0};
    const double error = rmse(set, whole, &selection);
    EXPECT_LT(error, before);
    before = error;
    if (std::string(GetParam()) == "lpca") continue;  // clusters depend on the rank
    const double own = rmse(set, encode(GetParam(), set, {{"rank", std::to_string(rank)}}));
    EXPECT_NEAR(error, own, 0.003 * own);
  }
  EXPECT_LT(before, 0.05);
  const double f16 =
      rmse(set, encode(GetParam(), set, {{"rank", "6"}, {"clusters", "3"}, {"precision", "f16"}}));
  const double u8 =
      rmse(set, encode(GetParam(), set, {{"rank", "6"}, {"clusters", "3"}, {"precision", "u8"}}));
  EXPECT_NEAR(f16, before, 1e-4);
  EXPECT_LT(std::sqrt(u8 * u8 - before * before), 0.01);
}

TEST_P(PcaModel, ExtremesDecodeFinitely) {
  const auto set_of = [](const Value& value, SampleType type, int view_rings, int light_rings) {
    return make_btf(btf_info(6, 5, 3, type, rings(view_rings), rings(light_rings)), value);
  };
  const auto constant = [](double v) {
    return [v](const Direction&, const Direction&, std::uint32_t, std::uint32_t, std::uint32_t) { return v; };
  };
  const Value hot = [](const Direction& v, const Direction& l, std::uint32_t x, std::uint32_t y,
                       std::uint32_t c) { return x == 2 && y == 1 ? 60000.0 : bumpy(v, l, x, y, c); };
  for (const char* precision : {"f32", "f16", "u8"}) {
    for (const char* rank : {"0", "1", "40"}) {
      const OptionValues options = {{"rank", rank}, {"precision", precision}, {"clusters", "30"}};
      for (const double v : {0.0, 0.4, 1.0})
        EXPECT_LT(rmse(set_of(constant(v), SampleType::unorm8, 1, 1),
                       encode(GetParam(), set_of(constant(v), SampleType::unorm8, 1, 1), options)),
                  1e-3);
      const Dataset one = set_of(bumpy, SampleType::unorm16, 0, 0);  // D = 1: the mean is everything
      EXPECT_LT(rmse(one, encode(GetParam(), one, options)), 0.004);
      const Dataset bright = set_of(hot, SampleType::float16, 1, 1);
      EXPECT_LT(rmse(bright, encode(GetParam(), bright, options)), 60000.0 / 100);
    }
  }
}

TEST_P(PcaModel, MissingPairs) {
  DatasetInfo info = btf_info(6, 6, 3, SampleType::float16, rings(2), rings(2));
  std::mt19937 random(8);
  std::erase_if(info.pairs, [&](const DirectionPair& p) { return p.light != p.view && random() % 2 == 0; });
  ASSERT_FALSE(info.full_product());
  const Dataset set = make_btf(info, bumpy);
  const Bytes file = encode(GetParam(), set, {{"rank", "40"}, {"clusters", "2"}});
  EXPECT_TRUE(verify_bytes(file));
  EXPECT_LT(rmse(set, file), 0.01);
}

// A measured direction gives its own value; what lies between is between.
TEST_P(PcaModel, InterpolatesBetweenDirections) {
  const Value ramp = [](const Direction& v, const Direction& l, std::uint32_t x, std::uint32_t,
                        std::uint32_t) { return 0.2 + 0.3 * v.theta / 1.6 + 0.2 * l.theta / 1.6 + 0.01 * x; };
  const Dataset set = make_btf(btf_info(9, 3, 1, SampleType::float16, rings(5), rings(5)), ramp);
  const TexturePtr t = load(encode(GetParam(), set, {{"rank", "8"}, {"clusters", "1"}}));
  ASSERT_TRUE(t);
  for (const double theta : {0.0, 22.5, 40.0, 74.9, 80.0, 90.0}) {
    const Vector3 v = unit_vector(direction_from_degrees(theta, 33));
    const float view[3] = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
    const float up[3] = {0, 0, 1};
    const double expected = 0.2 + 0.3 * std::min(theta, 75.0) / 180 * 3.14159265 / 1.6 + 0.04;
    EXPECT_NEAR(value_at(t.get(), 4, 1, view, up)[0], expected, 0.012) << theta;
  }
  const float below[3] = {0.5f, 0.1f, -0.4f}, horizon[3] = {0.5f, 0.1f, 0};
  EXPECT_EQ(value_at(t.get(), 1, 1, below, below), value_at(t.get(), 1, 1, horizon, horizon));
}

TEST_P(PcaModel, FitIsTheSameOnAnyNumberOfThreads) {
  const Dataset set = make_btf(btf_info(13, 9, 3, SampleType::unorm8, rings(2), rings(2)), bumpy);
  const OptionValues options = {{"rank", "5"}, {"clusters", "4"}};
  const Bytes one = encode(GetParam(), set, options, Codec::raw, 1);
  EXPECT_EQ(one, encode(GetParam(), set, options, Codec::raw, 2));
  EXPECT_EQ(one, encode(GetParam(), set, options, Codec::raw, 8));
}

TEST_P(PcaModel, SizesBeyondTheLimitsAreRefused) {
  const auto refused = [&](OptionValues options) {
    const Result<ItemDescription> item = format_of(GetParam()).describe(options);
    return !item && item.error().status == Status::bad_argument;
  };
  EXPECT_TRUE(refused({{"size", "65536x65536"}}));
  EXPECT_TRUE(refused({{"size", "64x64"}, {"views", "1025"}}));
  EXPECT_TRUE(refused({{"size", "64x64"}, {"rank", "256"}}));
  EXPECT_TRUE(refused(
      {{"size", "64x64"}, {"views", "1024"}, {"lights", "1024"}, {"rank", "255"}, {"clusters", "9"}}));
  EXPECT_FALSE(refused({{"size", "64x64"}, {"views", "151"}, {"lights", "151"}}));
}

// One texel a cluster is exact with no component at all; so are as many clusters as there are kinds of texel.
TEST(Lpca, ClustersOfOneTexelAndOfAKind) {
  const Dataset set = make_btf(btf_info(5, 4, 2, SampleType::float16, rings(1), rings(1)), bumpy);
  EXPECT_LT(rmse(set, encode("lpca", set, {{"clusters", "20"}, {"rank", "0"}})), 1e-6);
  EXPECT_LT(rmse(set, encode("lpca", set, {{"clusters", "999"}, {"rank", "7"}})), 1e-6);
  const Value kinds = [](const Direction& v, const Direction& l, std::uint32_t x, std::uint32_t y,
                         std::uint32_t c) { return bumpy(v, l, (x + y) % 3, 0, c); };
  const Dataset three = make_btf(btf_info(9, 7, 3, SampleType::float16, rings(1), rings(2)), kinds);
  EXPECT_LT(rmse(three, encode("lpca", three, {{"clusters", "3"}, {"rank", "0"}})), 1e-6);
  // More clusters than kinds: some would stay empty.
  EXPECT_LT(rmse(three, encode("lpca", three, {{"clusters", "6"}, {"rank", "1"}})), 1e-6);
}

// Points near planes that cross: no cluster of points shows them, local PCAs do.
TEST(Lpca, ClustersAreLocallyLinear) {
  std::mt19937 random(6);
  std::normal_distribution<float> normal;
  Matrix vectors = Matrix::Zero(600, 12);
  for (Eigen::Index i = 0; i < vectors.rows(); ++i) {
    for (Eigen::Index k = 0; k < 2; ++k) vectors(i, 4 * (i % 3) + k) = normal(random);
  }
  LpcaClusterOptions options;
  options.clusters = 3;
  options.rank = 2;
  const LpcaClusters found = lpca_clusters(vectors, options);
  EXPECT_LT(found.error, 0.02 * static_cast<double>(vectors.squaredNorm()));
  EXPECT_EQ(found.cluster.size(), 600u);
}

}  // namespace
}  // namespace btfc::test
