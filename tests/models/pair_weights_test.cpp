// Fits and measures of data sets whose pairs count differently.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "encoder/metrics/dataset_metrics.h"
#include "encoder/models/gm_gradient.h"
#include "encoder/models/ptm_fit.h"
#include "encoder/segment/subspaces.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

struct Case {
  const char* model;
  OptionValues options;
  bool in_place = true;  // texels stay where they are: errors are of texels
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"ptm", {}},
      {"plm", {{"polynomial", "none"}}},
      {"plm", {{"clusters", "6"}}},
      {"pcarf", {{"rank", "2"}}},
      {"pca", {{"rank", "4"}}},
      {"lpca", {{"clusters", "3"}, {"rank", "2"}}},
      {"gm", {{"components", "24"}, {"iterations", "400"}, {"precision", "f32"}}},
      {"gm", {{"fit", "em"}, {"components", "24"}, {"iterations", "10"}, {"precision", "f32"}}},
      {"car", {{"clusters", "3"}, {"levels", "2"}, {"order", "3"}}, false},
      {"gmrf", {{"clusters", "3"}, {"levels", "2"}, {"order", "3"}}, false},
      {"car3d", {{"clusters", "3"}, {"levels", "2"}, {"order", "3"}}, false},
  };
  return all;
}

std::string name_of(const Case& c) {
  std::string name = c.model;
  for (const auto& [option, value] : c.options) name += " " + option + "=" + value;
  return name;
}

// Of 7 views under 19 lights. weight: of a pair, before they are scaled to the mean 1.
DatasetInfo info_of(const std::function<double(const DirectionPair&)>& weight, std::uint32_t side = 9) {
  DatasetInfo info = btf_info(side, side, 2, SampleType::unorm16, rings(1), rings(2));
  if (!weight) return info;
  for (const DirectionPair& pair : info.pairs) info.weights.push_back(weight(pair));
  const double sum = std::accumulate(info.weights.begin(), info.weights.end(), 0.0);
  for (double& w : info.weights) w *= static_cast<double>(info.pairs.size()) / sum;
  return info;
}

// Lights from one side; too many to be shown exactly.
constexpr std::uint32_t kFirstHeavy = 11;
bool heavy(const DirectionPair& pair) { return pair.light >= kFirstHeavy; }

double strong(const DirectionPair& pair) { return heavy(pair) ? 100 : 1; }

// The mean squared error of each pair's image.
std::vector<double> errors(const Dataset& dataset, const Bytes& file) {
  const DatasetInfo& info = dataset.info();
  const TexturePtr texture = load(file);
  std::vector<double> all(info.pairs.size());
  for (std::uint32_t p = 0; p < info.pairs.size(); ++p) {
    btfc_directions d{};
    btfc_texture_view(texture.get(), info.pairs[p].view, d.view);
    btfc_texture_light(texture.get(), info.pairs[p].light, d.light);
    std::size_t first = 0;
    for (std::uint32_t m = 0; m < btfc_texture_maps(texture.get()); ++m) {
      btfc_map_info map{};
      btfc_texture_map_info(texture.get(), m, &map);
      std::vector<float> values(std::size_t{info.width} * info.height * map.channels);
      EXPECT_EQ(btfc_decode_rect(texture.get(), nullptr, m, &d, 0, 0, info.width, info.height, BTFC_FLOAT32,
                                 values.data(), info.width * map.channels * 4, values.size() * 4),
                BTFC_OK);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto texel = static_cast<std::uint32_t>(i / map.channels);
        const std::uint16_t code = dataset.code(p, texel % info.width, texel / info.width,
                                                static_cast<std::uint32_t>(first + i % map.channels));
        EXPECT_TRUE(std::isfinite(values[i]));
        const double off = double{values[i]} - double{code_value(info.type, code)};
        all[p] += off * off / static_cast<double>(info.image_samples());
      }
      first += map.channels;
    }
  }
  return all;
}

double heavy_rmse(const Dataset& dataset, const std::vector<double>& squares) {
  double sum = 0, count = 0;
  for (std::size_t p = 0; p < squares.size(); ++p) {
    if (!heavy(dataset.info().pairs[p])) continue;
    sum += squares[p];
    ++count;
  }
  return std::sqrt(sum / count);
}

bool same_chunks(const FitResult& a, const FitResult& b) {
  bool same = a.chunks.size() == b.chunks.size();
  for (std::size_t i = 0; same && i < a.chunks.size(); ++i) same = a.chunks[i].raw == b.chunks[i].raw;
  return same;
}

TEST(PairWeights, OfOneAreNone) {
  const Dataset none = make_btf(info_of({}), bumpy);
  const Dataset ones = make_btf(info_of([](const auto&) { return 1.0; }), bumpy);
  for (const Case& c : cases())
    EXPECT_TRUE(same_chunks(fit(c.model, none, c.options), fit(c.model, ones, c.options))) << name_of(c);
}

// The code of weights meets that without where weights hardly differ.
TEST(PairWeights, NearOneHardlyMatter) {
  const Dataset none = make_btf(info_of({}), bumpy);
  const Dataset near = make_btf(info_of([](const auto& pair) { return 1 + 1e-7 * (pair.light % 2); }), bumpy);
  ASSERT_FALSE(near.info().weights.empty());
  for (const char* model : {"ptm", "pcarf", "pca"}) {
    const double a = rmse(none, encode(model, none, {})), b = rmse(none, encode(model, near, {}));
    EXPECT_NEAR(b, a, 1e-3 * a + 1e-6) << model;
  }
}

TEST(PairWeights, StrongOnesLowerTheErrorWhereTheyAre) {
  const Dataset none = make_btf(info_of({}), bumpy), weighted = make_btf(info_of(strong), bumpy);
  for (const Case& c : cases()) {
    if (!c.in_place) continue;
    const double without = heavy_rmse(none, errors(none, encode(c.model, none, c.options))),
                 with = heavy_rmse(none, errors(none, encode(c.model, weighted, c.options)));
    EXPECT_LT(with, 0.97 * without) << name_of(c);
    RecordProperty(name_of(c), std::to_string(without / with));
  }
}

TEST(PairWeights, ThreadsChangeNothing) {
  const Dataset weighted = make_btf(info_of(strong), bumpy);
  for (const Case& c : cases())
    EXPECT_TRUE(same_chunks(fit(c.model, weighted, c.options, 1), fit(c.model, weighted, c.options, 3)))
        << name_of(c);
}

// What fits report is the weighted error of what is decoded.
TEST(PairWeights, ReportedErrorsAreWeighted) {
  const Dataset weighted = make_btf(info_of(strong), bumpy);
  const auto check = [&](const Case& c, const char* name) {
    const FitResult result = fit(c.model, weighted, c.options);
    const std::vector<double> squares = errors(weighted, pack(result, Codec::raw));
    double sum = 0;
    for (std::size_t p = 0; p < squares.size(); ++p) sum += weighted.info().weights[p] * squares[p];
    const double expected = std::sqrt(sum / static_cast<double>(squares.size()));
    double found = -1;
    for (const Parameter& p : result.report) {
      if (p.name == name) found = std::stod(p.value);
    }
    EXPECT_NEAR(found, expected, 2e-3 * expected) << name_of(c);
  };
  check({"ptm", {}}, "fit_rmse");
  check({"plm", {{"clusters", "6"}}}, "fit_rmse");
  check({"pcarf", {{"rank", "2"}}}, "svd_rmse");
  check({"pca", {{"rank", "4"}}}, "svd_rmse");
  check({"lpca", {{"clusters", "3"}, {"rank", "2"}}}, "svd_rmse");
}

// Twelve orders of magnitude: files are whole, pairs that count nothing do not disturb those that do, and
// what is shown of them stays within the largest value.
TEST(PairWeights, OfAnySizeGiveFiniteFiles) {
  const auto extreme = [](const DirectionPair& pair) { return heavy(pair) ? 1e6 : 1e-6; };
  const Dataset none = make_btf(info_of({}), bumpy), weighted = make_btf(info_of(extreme), bumpy);
  for (const Case& c : cases()) {
    const std::vector<double> with = errors(none, encode(c.model, weighted, c.options));
    // Without polynomials a lobe of plm is not held where nothing counts.
    const bool loose = c.model == std::string("plm") && c.options.contains("polynomial");
    EXPECT_LT(*std::max_element(with.begin(), with.end()), loose ? 4 : 1) << name_of(c);
  }
  // The fit of the pairs that count alone.
  DatasetInfo few = info_of({});
  few.lights.erase(few.lights.begin(), few.lights.begin() + kFirstHeavy);
  make_full_product(few);
  const Dataset alone = make_btf(few, bumpy);
  for (const Case& c : {Case{"pcarf", {{"rank", "2"}}}, Case{"pca", {{"rank", "4"}}}, Case{"ptm", {}}}) {
    const double expected = rmse(alone, encode(c.model, alone, c.options));
    EXPECT_NEAR(heavy_rmse(none, errors(none, encode(c.model, weighted, c.options))), expected,
                0.02 * expected)
        << name_of(c);
  }
}

// b of least weighted squares has residuals that are orthogonal to all terms under the weights.
TEST(PairWeights, PtmInverseSolvesTheWeightedEquations) {
  std::vector<Vector3> lights;
  std::vector<double> weights;
  for (const Direction& d : rings(2)) {
    lights.push_back(unit_vector(d));
    weights.push_back(std::pow(10.0, static_cast<double>(lights.size() % 4)));
  }
  const PtmInverse inverse = ptm_inverse(lights, weights);
  Eigen::VectorXd values(static_cast<Eigen::Index>(lights.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = std::sin(3.0 * static_cast<double>(i));
  Eigen::VectorXd rest = values - inverse.terms * (inverse.inverse * values);
  for (Eigen::Index i = 0; i < rest.size(); ++i) rest[i] *= weights[static_cast<std::size_t>(i)];
  EXPECT_LT((inverse.terms.transpose() * rest).cwiseAbs().maxCoeff(), 1e-8 * 1000);
}

// Of one pair everything that model gm's descent sums up is its weight times what it is without; by the plain
// loop too.
TEST(PairWeights, GmGradientGrowsWithThem) {
  const Dataset weighted = make_btf(info_of(strong), bumpy), none = make_btf(info_of({}), bumpy);
  GmSamples samples = gm_samples(weighted), alike = gm_samples(none);
  samples.mean = alike.mean = gm_mean_table(samples);
  GmMixture mixture = gm_make_mixture({8, samples.channels, true});
  SplitMix64 random(5);
  for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) {
    for (std::size_t m = 0; m < 8; ++m)
      mixture.row(r)[m] = static_cast<float>(r < 2 ? 9 * random.uniform() : random.uniform() - 0.5);
  }
  const GmField field = gm_field(mixture, samples.width, samples.height, samples.wraps);
  const GmPairGroup& group = samples.groups[0];
  GmGradientOptions options;
  options.statistics = true;
  for (const std::uint32_t pair : group.pairs) {
    const GmVisit visit{0, 0, 8, 8, &group, {&pair, 1}};
    const double weight = weighted.info().weights[pair];
    GmScratch scratch;
    GmSums with, without;
    with.clear(field.stride);
    without.clear(field.stride);
    gm_add_gradient(field, samples, visit, options, scratch, with);
    gm_add_gradient(field, alike, visit, options, scratch, without);
    EXPECT_NEAR(with.squared_error, weight * without.squared_error, 1e-6 * with.squared_error);
    const auto check = [&](const auto& a, const auto& b, double tolerance) {
      double largest = 0;
      for (const auto v : b) largest = std::max(largest, std::fabs(double{v}));
      ASSERT_GT(largest, 0);
      for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_NEAR(double{a[i]}, weight * double{b[i]}, tolerance * weight * largest);
    };
    check(with.gradient, without.gradient, 1e-5);
    check(with.usage, without.usage, 1e-5);
    check(with.error, without.error, 1e-5);
    GmPlainSums plain_with, plain_without;
    gm_add_gradient_plain(mixture, samples, visit, plain_with);
    gm_add_gradient_plain(mixture, alike, visit, plain_without);
    EXPECT_NEAR(plain_with.squared_error, weight * plain_without.squared_error,
                1e-6 * plain_with.squared_error);
    check(plain_with.gradient, plain_without.gradient, 1e-6);
  }
}

// The pairs that count have images of their subspaces that are nearer to them.
TEST(PairWeights, SegmentationFollowsThem) {
  const auto brightness = [](const Direction& view, const Direction& light, std::uint32_t x, std::uint32_t y,
                             std::uint32_t) {
    return std::clamp(0.7 * std::cos(light.theta) * std::cos(view.theta) + 0.2 * std::sin(light.phi) +
                          0.02 * static_cast<double>((x * 7 + y * 5) % 11),
                      0.0, 1.0);
  };
  const Dataset none = make_btf(info_of({}), brightness), weighted = make_btf(info_of(strong), brightness);
  const auto mean_of = [&](std::size_t pair) {
    double sum = 0;
    const Image image = none.image(pair);
    for (const std::uint16_t code : image.codes) sum += double{code_value(image.type, code)};
    return sum / static_cast<double>(image.codes.size());
  };
  const auto error = [&](const Subspaces& s) {
    double sum = 0;
    for (std::size_t p = 0; p < none.info().pairs.size(); ++p) {
      const double off = mean_of(p) - mean_of(s.medoid[s.of_pair[p]]);
      if (heavy(none.info().pairs[p])) sum += off * off;
    }
    return sum;
  };
  const auto without = segment_pairs(none, 5, 1), with = segment_pairs(weighted, 5, 1);
  ASSERT_TRUE(without && with);
  EXPECT_LT(error(*with), error(*without));
}

TEST(PairWeights, MeasuresCountThem) {
  DatasetInfo info = btf_info(16, 16, 3, SampleType::unorm8, rings(0), rings(1));
  info.pairs.resize(2);
  const auto grey = [](const Direction&, const Direction&, std::uint32_t, std::uint32_t, std::uint32_t) {
    return 0.4;
  };
  const auto off = [](const Direction&, const Direction& light, std::uint32_t, std::uint32_t, std::uint32_t) {
    return light.theta == 0 ? 0.6 : 0.4;
  };
  const Dataset candidate = make_btf(info, off), plain = make_btf(info, grey);
  info.weights = {0.5, 1.5};
  const Dataset reference = make_btf(info, grey);
  const auto without = compare_datasets(plain, candidate), with = compare_datasets(reference, candidate);
  ASSERT_TRUE(without && with);
  EXPECT_FALSE(without->weighted);
  EXPECT_TRUE(with->weighted);
  EXPECT_NEAR(without->all.rmse_8bit, 51 / std::sqrt(2), 1e-3);
  EXPECT_NEAR(with->all.rmse_8bit, 51 / std::sqrt(4), 1e-3);
  EXPECT_NEAR(with->all.psnr_db, 20 * std::log10(5) + 10 * std::log10(4), 1e-4);
  EXPECT_NEAR(with->all.mean_psnr_db, (20 * std::log10(5) + 3 * kMostPsnrDb) / 4, 1e-4);
  EXPECT_NEAR(with->all.brdf_rmse_8bit, 51 / std::sqrt(4), 1e-3);
  EXPECT_NEAR(1 - with->all.ssim, (1 - without->all.ssim) / 2, 1e-6);
  EXPECT_EQ(with->all.psnr_db_p5, without->all.psnr_db_p5);
  EXPECT_EQ(with->views.at(0).psnr_db, with->all.psnr_db);
}

}  // namespace
}  // namespace btfc::test
