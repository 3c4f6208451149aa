// Model gm without files: sizes, codes, the shared maths, gradients, both fits and the fast evaluation, each
// against a plain loop in doubles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "encoder/models/gm_em.h"
#include "encoder/models/gm_gradient.h"
#include "encoder/models/gm_refined.h"
#include "encoder/models/gm_samples.h"
#include "encoder/run_on_threads.h"
#include "encoder/split_mix.h"
#include "format/models/gm_evaluate.h"
#include "format/models/gm_field.h"
#include "format/models/gm_payload.h"
#include "shaders/btfc_math.h"
#include "shaders/models/gm.h"

namespace btfc::test {
namespace {

struct Kind {
  std::uint32_t width = 21, height = 14, channels = 3, views = 7, lights = 9;
  bool wraps = true;
  SampleType type = SampleType::unorm8;
  bool missing = false;  // some pairs
};

// Directions spread over the hemisphere, the pole and the horizon among them.
std::vector<Direction> some_directions(std::uint32_t count) {
  std::vector<Direction> out;
  for (std::uint32_t i = 0; i < count; ++i) {
    out.push_back(direction_from_degrees(90.0 * i / std::max(1u, count - 1), 137.5 * i));
  }
  return out;
}

// value(x, y, pair, channel) in [0, 1].
template <class Value>
Dataset make_dataset(const Kind& kind, const Value& value) {
  DatasetInfo info;
  info.width = kind.width;
  info.height = kind.height;
  info.channels = {"R", "G", "B", "X"};
  info.channels.resize(kind.channels);
  info.type = kind.type;
  info.wraps = kind.wraps;
  info.views = some_directions(kind.views);
  info.lights = some_directions(kind.lights);
  make_full_product(info);
  if (kind.missing) std::erase_if(info.pairs, [](DirectionPair p) { return (p.view + p.light) % 5 == 3; });
  auto dataset = Dataset::create(std::move(info), "");
  EXPECT_TRUE(dataset);
  std::vector<std::uint16_t> codes(dataset->info().image_samples());
  for (std::size_t p = 0; p < dataset->info().pairs.size(); ++p) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const auto x = static_cast<double>(i / kind.channels % kind.width);
      const auto y = static_cast<double>(i / kind.channels / kind.width);
      codes[i] = static_cast<std::uint16_t>(
          std::lround(255 * value(x, y, dataset->info().pairs[p], static_cast<double>(i % kind.channels))));
    }
    dataset->write_image(p, codes);
  }
  return std::move(*dataset);
}

// A pattern that drifts with the view and shines towards the light.
double woven(double x, double y, DirectionPair p, double c) {
  const double wave = std::sin(2 * std::numbers::pi * (x / 21 + 0.05 * p.view)) *
                      std::cos(2 * std::numbers::pi * (y / 14 - 0.04 * p.light));
  return std::clamp(0.45 + 0.3 * wave - 0.03 * p.light + 0.02 * p.view + 0.05 * c, 0.0, 1.0);
}

GmSamples with_mean(const Dataset& dataset, std::uint32_t rank = 3) {
  GmSamples samples = gm_samples(dataset);
  samples.mean =
      gm_decoded_mean(samples, gm_code_mean(samples, gm_mean_table(samples), GmMeanForm::coded, rank));
  return samples;
}

GmMixture random_mixture(std::uint32_t components, const Kind& kind, std::uint64_t seed, bool shear = true) {
  SplitMix64 random(seed);
  GmMixture mixture = gm_make_mixture({components, kind.channels, shear});
  for (std::uint32_t m = 0; m < components; ++m) {
    for (std::uint32_t n = 0; n < 6; ++n) {
      const double middle = n == 0   ? kind.width * random.uniform()
                            : n == 1 ? kind.height * random.uniform()
                                     : 3 * random.uniform() - 1.5;
      mixture.row(kGmMeanRow + n)[m] = static_cast<float>(middle);
      mixture.row(kGmSpreadRow + n)[m] = static_cast<float>((n < 2 ? 1.5 : -1.0) + 0.6 * random.gauss());
    }
    mixture.row(kGmHeightRow)[m] = static_cast<float>(random.gauss());
    for (std::uint32_t c = 0; c < kind.channels; ++c) {
      mixture.row(kGmOutputRow + c)[m] = static_cast<float>(0.3 * random.gauss());
    }
    for (std::uint32_t h = 0; h < 2 && shear; ++h) {
      mixture.row(mixture.shape.shear_row() + h)[m] = static_cast<float>(0.4 * random.gauss());
    }
  }
  return mixture;
}

std::vector<GmQuery> random_queries(std::size_t count, const Kind& kind, std::uint64_t seed) {
  SplitMix64 random(seed);
  const auto direction = [&] {
    const double z = random.uniform(), phi = 2 * std::numbers::pi * random.uniform(),
                 r = std::sqrt(1 - z * z);
    return vec3(r * std::cos(phi), r * std::sin(phi), z);
  };
  std::vector<GmQuery> queries(count);
  for (GmQuery& q : queries) {
    q.x = static_cast<float>(kind.width * random.uniform());
    q.y = static_cast<float>(kind.height * random.uniform());
    const vec3 view = direction(), light = direction();
    q.directions = gm_pair_inputs(gm_directions(view, light, 0));
  }
  return queries;
}

GmParams params_of_field(const GmField& field, std::uint32_t gates) {
  GmParams p{};
  p.width = static_cast<uint>(field.width);
  p.height = static_cast<uint>(field.height);
  p.wrap_u = p.wrap_v = field.wraps ? 1 : 0;
  p.channels = p.all_channels = field.channels;
  p.components = field.components;
  p.gates = gates;
  return p;
}

BtfcWords words_of_components(const std::vector<std::uint32_t>& words) {
  BtfcWords all{};
  all.slot[GM_COMPONENTS] = words.data();
  return all;
}

double mean_square(const GmSamples& samples, const GmMixture& mixture) {
  const GmField field = gm_field(mixture, samples.width, samples.height, samples.wraps);
  GmGradientOptions options;
  options.gradient = false;
  options.reach = 24;
  GmScratch scratch;
  GmSums sums;
  for (const GmPairGroup& group : samples.groups) {
    for (std::uint32_t y = 0; y < samples.height; y += kGmTile) {
      for (std::uint32_t x = 0; x < samples.width; x += kGmTile) {
        gm_add_gradient(field, samples,
                        {x, y, std::min(kGmTile, samples.width - x), std::min(kGmTile, samples.height - y),
                         &group, group.pairs},
                        options, scratch, sums);
      }
    }
  }
  EXPECT_EQ(sums.samples, samples.count());
  return sums.squared_error / (static_cast<double>(samples.count()) * samples.channels);
}

TEST(GmSizes, ThePapersCountsAndWhatTheyLeaveOut) {
  EXPECT_EQ(gm_paper_bits(500, 6561, 3, true), 917856u);
  EXPECT_EQ(gm_paper_bits(500, 6561, 3, false), 445464u);
  EXPECT_EQ(gm_paper_bits(600, 6561, 3, false), 62883u * 8);
  Head head;
  head.width = head.height = 256;
  head.views = head.lights = 81;
  head.pairs = 6561;
  head.maps = {Map{}};
  GmParm paper;
  paper.layout = GmLayout::paper;
  paper.precision = Precision::f32;
  paper.mean = GmMeanForm::u8;
  paper.shear = false;
  EXPECT_EQ(gm_formula_bits(head, paper), (65283u + 16) * 8) << "with the weights, and PARM";
}

TEST(GmSizes, FormulaIsWhatTheCodesTake) {
  const Kind kind;
  for (const Precision precision : {Precision::f32, Precision::f16, Precision::u8}) {
    for (const bool shear : {false, true}) {
      const GmMixture mixture = random_mixture(37, kind, 5, shear);
      const GmCodes codes = gm_quantise(mixture, precision);
      EXPECT_EQ(gm_mixture_bits(mixture.shape, precision), 8 * write_coded_rows(codes.rows).size());
      EXPECT_EQ(gm_level_begin(37, 3, 0), 0u);
      EXPECT_EQ(gm_level_begin(37, 3, 1), 10u);
      EXPECT_EQ(gm_level_begin(37, 3, 2), 19u);
      EXPECT_EQ(gm_level_begin(37, 3, 3), 37u);
    }
  }
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = gm_samples(dataset);
  const auto table = gm_mean_table(samples);
  const GmMean coded = gm_code_mean(samples, table, GmMeanForm::coded, 4);
  EXPECT_EQ(gm_mean_bits(GmMeanForm::coded, kind.views, kind.lights, 63, 3, 4),
            8 * (4 * coded.steps.size() + coded.view_codes.size() + coded.light_codes.size()));
  EXPECT_EQ(gm_mean_bits(GmMeanForm::f32, kind.views, kind.lights, 63, 3, 0), 32 * table.size());
}

TEST(GmCodes, RoundingIsWithinHalfAStep) {
  const GmMixture mixture = random_mixture(200, {}, 6);
  EXPECT_EQ(gm_dequantise(gm_quantise(mixture, Precision::f32)), mixture);
  const GmMixture half = gm_dequantise(gm_quantise(mixture, Precision::f16));
  const GmCodes codes = gm_quantise(mixture, Precision::u8);
  const std::vector<RowScale>& scales = codes.rows.scales;
  const GmMixture eight = gm_dequantise(codes);
  for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) {
    const auto [low, high] = std::minmax_element(mixture.row(r).begin(), mixture.row(r).end());
    const float step = (*high - *low) / 255;
    for (std::uint32_t m = 0; m < mixture.shape.components; ++m) {
      const float v = mixture.row(r)[m];
      EXPECT_NEAR(half.row(r)[m], v, std::fabs(v) * 0x1p-11f + 0x1p-24f);
      EXPECT_NEAR(eight.row(r)[m], v, 0.501f * step);
      EXPECT_EQ(rounded(v, Precision::u8, scales[r]), eight.row(r)[m]);
    }
  }
  EXPECT_EQ(gm_quantise(eight, Precision::u8, scales), codes) << "codes of rounded numbers are the same";
}

TEST(GmCodes, EndsOfRanges) {
  EXPECT_EQ(rounded(7, Precision::u8, scale_between(3, 3)), 3) << "a row of equal numbers";
  EXPECT_EQ(rounded(-1e30f, Precision::u8, scale_between(-2, 5)), -2);
  EXPECT_EQ(rounded(1e30f, Precision::u8, scale_between(-2, 5)), 5);
  EXPECT_EQ(rounded(1e6f, Precision::f16, {}), 65504) << "the largest half";
  EXPECT_EQ(rounded(-1e6f, Precision::f16, {}), -65504);
}

TEST(GmOrder, FallingEnergy) {
  const GmMixture mixture = random_mixture(4, {}, 7);
  const GmMixture ordered = gm_ordered(mixture, std::vector<double>{1, 4, 2, 4});
  const std::size_t from[] = {1, 3, 2, 0};
  for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) {
    for (std::size_t m = 0; m < 4; ++m) EXPECT_EQ(ordered.row(r)[m], mixture.row(r)[from[m]]);
  }
}

TEST(GmMath, ElementaryFunctionsAgainstDoubles) {
  for (int i = -126000; i <= 126000; i += 7) {
    const float x = static_cast<float>(i) / 1000;
    EXPECT_NEAR(static_cast<double>(btfc_exp2(x)) / std::exp2(static_cast<double>(x)), 1, 3e-7) << x;
  }
  EXPECT_EQ(btfc_exp2(0), 1);
  EXPECT_EQ(btfc_exp2(-1e30f), btfc_exp2(-126)) << "far below: the end";
  SplitMix64 random(3);
  for (int i = 0; i < 200000; ++i) {
    const auto v = static_cast<float>(std::exp2(120 * random.uniform() - 60));
    const double log2 = std::log2(static_cast<double>(v));
    EXPECT_NEAR(static_cast<double>(btfc_log2(v)), log2, 1e-6 + std::fabs(log2) * 1e-7);
    EXPECT_NEAR(static_cast<double>(btfc_sqrt(v)) / std::sqrt(static_cast<double>(v)), 1, 4e-7);
    const auto x = static_cast<float>(random.gauss()), y = static_cast<float>(random.gauss());
    EXPECT_NEAR(static_cast<double>(btfc_atan2(y, x)),
                std::atan2(static_cast<double>(y), static_cast<double>(x)), 6e-7);
  }
  EXPECT_EQ(btfc_sqrt(0), 0);
  EXPECT_EQ(btfc_atan2(0, 0), 0);
  EXPECT_NEAR(btfc_atan2(1, 0), 1.5707963f, 2e-7f);
  EXPECT_NEAR(btfc_atan2(-1, 0), -1.5707963f, 2e-7f);
  EXPECT_NEAR(btfc_atan2(0, -1), 3.1415927f, 4e-7f);
}

TEST(GmMath, OnionAnglesAreSignedAndCrossNoSeam) {
  const auto angles = [](double theta, double phi) {
    const Vector3 v = unit_vector(direction_from_degrees(theta, phi));
    return gm_onion(vec3(v[0], v[1], v[2]));
  };
  EXPECT_NEAR(angles(0, 0).x, 0, 1e-6);
  EXPECT_NEAR(angles(0, 0).y, 0, 1e-6);
  EXPECT_NEAR(angles(40, 0).x, 40 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(angles(40, 180).x, -40 * std::numbers::pi / 180, 1e-6) << "mirror directions differ";
  EXPECT_NEAR(angles(40, 90).y, 40 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(angles(40, 270).y, -40 * std::numbers::pi / 180, 1e-6);
  const vec2 a = angles(60, 1e-4), b = angles(60, 360 - 1e-4);
  EXPECT_NEAR(a.x, b.x, 1e-5);
  EXPECT_NEAR(a.y, b.y, 1e-5);
  // The horizon: slopes end at that of z = 0.2.
  EXPECT_NEAR(gm_slope(vec3(1, 0, 0)).x, 5, 1e-6);
  EXPECT_NEAR(gm_slope(vec3(0, 0.6f, 0.8f)).y, -0.75, 1e-6) << "rows run down, y up";
}

// Every way to evaluate against doubles.
TEST(GmEvaluate, HeaderImageAndBatchAgainstDoubles) {
  for (const bool wraps : {false, true}) {
    for (const std::uint32_t gates : {0u, 1u, 8u, 500u}) {
      for (const std::uint32_t channels : {1u, 3u}) {
        Kind kind;
        kind.channels = channels;
        const GmField field = gm_field(random_mixture(150, kind, 8), kind.width, kind.height, wraps);
        const auto queries = random_queries(3000, kind, 9);
        std::vector<float> plain(queries.size() * channels), batch(plain.size()), image(plain.size());
        gm_evaluate_plain(field, queries, gates, plain);
        gm_evaluate_batch(field, queries, {gates, 1e-6f}, batch);
        const auto words = gm_component_words(field);
        const BtfcWords all = words_of_components(words);
        const GmParams params = params_of_field(field, gates);
        // A tie or a hair's breadth between the K-th gates may go either way: counted, not summed.
        std::size_t off = 0;
        for (std::size_t i = 0; i < queries.size(); ++i) {
          const GmPairInputs& in = queries[i].directions;
          GmState s{};
          s.directions = {{in.angle[0], in.angle[1]},
                          {in.angle[2], in.angle[3]},
                          {in.slope[0], in.slope[1]},
                          {in.slope[2], in.slope[3]}};
          const auto sum = gates == 0 ? gm_of_all : gm_of_best;
          const vec4 header = sum(all, params, s, queries[i].x, queries[i].y);
          for (std::uint32_t c = 0; c < channels; ++c) {
            const float wanted = plain[i * channels + c];
            if (std::fabs(batch[i * channels + c] - wanted) > 1e-4f) ++off;
            if (gates <= GM_MOST_GATES && std::fabs(header[static_cast<int>(c)] - wanted) > 1e-4f) ++off;
          }
        }
        EXPECT_LE(off, gates == 0 || gates >= 150 ? 0u : 3u) << wraps << gates << channels;
      }
    }
  }
}

TEST(GmEvaluate, ImageIsTheBatchOfItsTexels) {
  const Kind kind;
  const GmField field = gm_field(random_mixture(120, kind, 10), kind.width, kind.height, true);
  std::vector<float> xs, ys;
  for (int i = 0; i < 67; ++i) xs.push_back(static_cast<float>(kind.width) * static_cast<float>(i) / 67);
  for (int i = 0; i < 35; ++i) ys.push_back(static_cast<float>(kind.height) * static_cast<float>(i) / 35);
  const GmPairInputs directions = random_queries(1, kind, 11)[0].directions;
  std::vector<GmQuery> queries;
  for (const float y : ys) {
    for (const float x : xs) queries.push_back({x, y, directions});
  }
  std::vector<float> image(queries.size() * 3), plain(image.size());
  for (const float error : {1e-6f, 1e-3f}) {
    std::vector<float> rows;
    const GmSlice slice = gm_slice(field, directions, 0, vec4(0), error, rows);
    gm_evaluate_image(slice, xs, ys, {0, error}, image);
    gm_evaluate_plain(field, queries, 0, plain);
    // Twice: once for the slice, once for a tile of it; outputs range over less than 3.
    for (std::size_t i = 0; i < image.size(); ++i) ASSERT_NEAR(image[i], plain[i], 1e-5f + 6 * error) << i;
  }
}

TEST(GmEvaluate, ExtremesStayFinite) {
  Kind kind;
  GmMixture mixture = random_mixture(40, kind, 12);
  for (std::uint32_t m = 0; m < 40; ++m) {
    // Spikes far from most queries, components 10^4 domains wide, twins, and weights of nothing.
    for (std::uint32_t n = 0; n < 6; ++n) mixture.row(kGmSpreadRow + n)[m] = m % 4 == 1 ? 17.7f : -6.0f;
    if (m % 4 == 2) {
      for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) mixture.row(r)[m] = mixture.row(r)[m - 2];
    }
    if (m % 4 == 3 || m % 4 == 1) mixture.row(kGmHeightRow)[m] = -1e30f;
  }
  const GmField field = gm_field(mixture, kind.width, kind.height, false);
  const auto queries = random_queries(2000, kind, 13);
  std::vector<float> plain(queries.size() * 3), batch(plain.size());
  gm_evaluate_plain(field, queries, 0, plain);
  gm_evaluate_batch(field, queries, {}, batch);
  std::size_t off = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    ASSERT_TRUE(std::isfinite(batch[i]));
    // Gates of 10^5 powers of two leave a rounding of a hundredth in a float; the winner is the same.
    if (std::fabs(batch[i] - plain[i]) > 0.02f) ++off;
  }
  EXPECT_LE(off, batch.size() / 100);
}

TEST(GmEvaluate, FootprintWidensAndFlattens) {
  // One narrow component over a wide one: under a large footprint the wide one wins nearly all.
  GmMixture mixture = gm_make_mixture({2, 1, false});
  for (std::uint32_t n = 0; n < 6; ++n) {
    mixture.row(kGmMeanRow + n)[0] = mixture.row(kGmMeanRow + n)[1] = n < 2 ? 8.0f : 0.0f;
    mixture.row(kGmSpreadRow + n)[0] = n < 2 ? -1.0f : 0.0f;
    mixture.row(kGmSpreadRow + n)[1] = n < 2 ? 4.0f : 0.0f;
  }
  mixture.row(kGmHeightRow)[0] = 5;
  mixture.row(kGmOutputRow)[0] = 1;
  const GmField field = gm_field(mixture, 16, 16, false);
  const auto words = gm_component_words(field);
  const BtfcWords all = words_of_components(words);
  const GmParams params = params_of_field(field, 0);
  GmState s{};
  s.directions = gm_directions(vec3(0, 0, 1), vec3(0, 0, 1), 0);
  EXPECT_NEAR(gm_of_all(all, params, s, 8, 8).x, 32.0 / 33, 1e-5);
  // Variance 16 texels^2: the narrow peak falls by 1 + 16 / 0.25, the wide one by 1 + 16 / 256.
  const double narrow = 32.0 / 65, wide = 1.0 / (1 + 1.0 / 16);
  s.variance = 16;
  EXPECT_NEAR(gm_of_all(all, params, s, 8, 8).x, narrow / (narrow + wide), 1e-5);
  // The far limit: weights by area, and with it taken off nothing is left far away.
  const double far_narrow = 32 * 0.25, far_wide = 256;
  s.far_limit = gm_far_limit(all, params, s.directions);
  EXPECT_NEAR(s.far_limit.x, far_narrow / (far_narrow + far_wide), 1e-6);
  s.variance = gm_variance(1e9f);
  EXPECT_NEAR(gm_of_all(all, params, s, 3, 5).x, 0, 1e-6);
}

TEST(GmMean, FactorsConvergeAndMissingPairsCountForNothing) {
  for (const bool missing : {false, true}) {
    Kind kind;
    kind.missing = missing;
    const Dataset dataset = make_dataset(kind, woven);
    const GmSamples samples = gm_samples(dataset);
    const auto table = gm_mean_table(samples);
    double before = 1e9;
    for (const std::uint32_t rank : {1u, 3u, 6u}) {
      const auto decoded = gm_decoded_mean(samples, gm_code_mean(samples, table, GmMeanForm::coded, rank));
      double square = 0;
      for (std::size_t i = 0; i < table.size(); ++i) {
        square += std::pow(static_cast<double>(decoded[i] - table[i]), 2);
      }
      const double rms = std::sqrt(square / static_cast<double>(table.size()));
      EXPECT_LT(rms, before);
      before = rms;
    }
    EXPECT_LT(before, 0.002);
    const auto raw = gm_decoded_mean(samples, gm_code_mean(samples, table, GmMeanForm::u8, 0));
    for (std::size_t i = 0; i < table.size(); ++i) ASSERT_NEAR(raw[i], table[i], 0.5 / 255 + 1e-6);
    EXPECT_EQ(gm_decoded_mean(samples, gm_code_mean(samples, table, GmMeanForm::f32, 0)), table);
  }
}

TEST(GmGradient, AgainstThePlainLoop) {
  for (const bool wraps : {false, true}) {
    for (const std::uint32_t channels : {1u, 2u, 3u, 4u}) {
      Kind kind;
      kind.wraps = wraps;
      kind.channels = channels;
      const Dataset dataset = make_dataset(kind, woven);
      const GmSamples samples = with_mean(dataset);
      const GmMixture mixture = random_mixture(45, kind, 20 + channels);
      const GmField field = gm_field(mixture, kind.width, kind.height, wraps);
      GmSums fast;
      fast.clear(field.stride);
      GmPlainSums plain;
      GmScratch scratch;
      GmGradientOptions options;
      options.reach = 30;
      options.statistics = true;
      for (const GmPairGroup& group : samples.groups) {
        const GmVisit visit{16, 8, 5, 6, &group, group.pairs};
        gm_add_gradient(field, samples, visit, options, scratch, fast);
        gm_add_gradient_plain(mixture, samples, visit, plain);
      }
      EXPECT_NEAR(fast.squared_error / plain.squared_error, 1, 1e-5);
      for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
        double largest = 0;
        for (std::size_t m = 0; m < 45; ++m)
          largest = std::max(largest, std::fabs(plain.gradient[r * 45 + m]));
        for (std::size_t m = 0; m < 45; ++m) {
          ASSERT_NEAR(static_cast<double>(fast.gradient[r * field.stride + m]), plain.gradient[r * 45 + m],
                      2e-4 * largest + 1e-6)
              << "row " << r << " component " << m;
        }
      }
      double usage = 0;
      for (const float u : fast.usage) usage += static_cast<double>(u);
      EXPECT_NEAR(usage / static_cast<double>(fast.samples), 1, 1e-5) << "gates add up to 1";
    }
  }
}

TEST(GmGradient, ThePlainLoopAgainstDifferences) {
  Kind kind;
  kind.wraps = false;  // on the torus the error has kinks half way round
  const Dataset dataset = make_dataset(kind, woven);
  GmSamples samples = with_mean(dataset);
  samples.low = -10;  // nothing is cut off: there the error has kinks too
  samples.high = 10;
  GmMixture mixture = random_mixture(6, kind, 31);
  const GmVisit visit{3, 2, 7, 8, &samples.groups[0], samples.groups[0].pairs};
  GmPlainSums at;
  gm_add_gradient_plain(mixture, samples, visit, at);
  for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) {
    const std::uint32_t field_row =
        r >= mixture.shape.shear_row() ? GM_SHEAR + r - mixture.shape.shear_row() : r;
    for (std::size_t m = 0; m < 6; ++m) {
      const float kept = mixture.row(r)[m], step = 1.0f / 512;
      double error[2];
      for (const int side : {0, 1}) {
        mixture.row(r)[m] = side == 0 ? kept - step : kept + step;
        GmPlainSums there;
        gm_add_gradient_plain(mixture, samples, visit, there);
        error[side] = there.squared_error;
      }
      const auto width = static_cast<double>((kept + step) - (kept - step));
      mixture.row(r)[m] = kept;
      const double wanted = 0.5 * (error[1] - error[0]) / width;
      ASSERT_NEAR(at.gradient[field_row * 6 + m], wanted, 2e-3 * std::fabs(wanted) + 1e-3) << r << " " << m;
    }
  }
}

TEST(GmRefined, FitsAndIsTheSameForAnyThreads) {
  const Kind kind;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  GmMixture nothing = gm_make_mixture({1, 3, false});
  const double mean_alone = mean_square(samples, nothing);
  GmRefinedOptions options;
  options.components = 40;
  options.iterations = 400;
  options.split_every = 60;
  options.growth = 1.5f;
  options.rate = 2.5f;  // short, and so in long steps
  GmCodes codes[2];
  for (const unsigned threads : {1u, 3u}) {
    run_on_threads(threads, [&] { codes[threads / 2] = gm_fit_refined(samples, options)->codes; });
  }
  EXPECT_EQ(codes[0], codes[1]);
  EXPECT_EQ(codes[0].shape, (GmShape{40, 3, true}));
  const double fitted = mean_square(samples, gm_dequantise(codes[0]));
  EXPECT_LT(fitted, mean_alone / 8) << "9 dB at least";
  options.seed = 2;
  EXPECT_NE(gm_fit_refined(samples, options)->codes, codes[0]);
}

TEST(GmRefined, AllPrecisionsGatesAndNoShear) {
  Kind kind;
  kind.wraps = false;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  const double mean_alone = mean_square(samples, gm_make_mixture({1, 3, false}));
  for (const Precision precision : {Precision::f32, Precision::f16, Precision::u8}) {
    GmRefinedOptions options;
    options.components = 24;
    options.iterations = 200;
    options.rate = 2.5f;
    options.precision = precision;
    options.shear = precision != Precision::f16;
    const GmCodes codes = gm_fit_refined(samples, options)->codes;
    EXPECT_EQ(codes.shape.shear, options.shear);
    EXPECT_LT(mean_square(samples, gm_dequantise(codes)), mean_alone / 3);
  }
}

// Whatever the state at which a fit is cut off, it goes on to the same end.
TEST(GmRefined, GoesOnFromASavedState) {
  const Dataset dataset = make_dataset({}, woven);
  const GmSamples samples = with_mean(dataset);
  for (const Precision precision : {Precision::f32, Precision::u8}) {
    GmRefinedOptions options;
    options.components = 40;
    options.iterations = 700;
    options.precision = precision;
    std::vector<Bytes> states;
    options.save = [&](const Bytes& state) { states.push_back(state); };
    options.save_seconds = 0;
    const GmCodes whole = gm_fit_refined(samples, options)->codes;
    ASSERT_GT(states.size(), 300u);
    for (const std::size_t at : {std::size_t{3}, states.size() / 2, states.size() - 1}) {
      GmRefinedOptions rest = options;
      rest.save = {};
      rest.resume = states[at];
      EXPECT_EQ(gm_fit_refined(samples, rest)->codes, whole) << at;
    }
    options.resume = states[5];
    options.resume.pop_back();
    EXPECT_FALSE(gm_fit_refined(samples, options)) << "a byte short";
  }
}

TEST(GmRefined, Extremes) {
  const auto fit = [](const Kind& kind, auto value, std::uint32_t components) {
    const Dataset dataset = make_dataset(kind, value);
    const GmSamples samples = with_mean(dataset);
    GmRefinedOptions options;
    options.components = components;
    options.iterations = 60;
    const GmMixture mixture = gm_dequantise(gm_fit_refined(samples, options)->codes);
    for (const float v : mixture.values) EXPECT_TRUE(std::isfinite(v));
    return mean_square(samples, mixture);
  };
  Kind small;
  small.width = small.height = 3;
  EXPECT_LT(fit(small, woven, 1), 0.1) << "one component";
  EXPECT_LT(fit(
                small, [](auto...) { return 0.5; }, 8),
            1e-4)
      << "a constant material";
  EXPECT_LT(fit(
                small, [](auto...) { return 0.0; }, 8),
            1e-6)
      << "black";
  Kind pair = small;
  pair.views = pair.lights = 1;
  EXPECT_LT(fit(pair, woven, 8), 0.05) << "one pair of directions";
  EXPECT_TRUE(std::isfinite(fit(
      small, [](double x, double y, auto, auto) { return x + y == 0 ? 1.0 : 0.0001; }, 8)))
      << "one texel far above the others";
}

TEST(GmEm, ThePassAgainstThePlainLoop) {
  for (const bool wraps : {false, true}) {
    for (const std::uint32_t channels : {1u, 3u}) {
      Kind kind;
      kind.wraps = wraps;
      kind.channels = channels;
      const Dataset dataset = make_dataset(kind, woven);
      const GmSamples samples = with_mean(dataset);
      const GmEmMixture mixture = gm_em_random(samples, 29, 4);
      const GmEmSums fast = gm_em_pass(samples, mixture, {});
      const GmEmSums plain =
          gm_em_pass_plain(samples, mixture, 0, static_cast<std::uint32_t>(samples.pairs.size()));
      ASSERT_EQ(fast.samples, plain.samples);
      EXPECT_NEAR(fast.log_likelihood, plain.log_likelihood, 1e-5 * std::fabs(plain.log_likelihood));
      const auto count = static_cast<double>(plain.samples);
      for (std::size_t m = 0; m < 29; ++m) ASSERT_NEAR(fast.sum[m], plain.sum[m], 1e-6 * count);
      for (std::size_t i = 0; i < plain.first.size(); ++i) {
        ASSERT_NEAR(fast.first[i], plain.first[i], 1e-5 * std::sqrt(count * plain.second[i]) + 1e-6 * count);
        ASSERT_NEAR(fast.second[i], plain.second[i], 1e-4 * plain.second[i] + 1e-6 * count);
      }
      EXPECT_LT(fast.listed, plain.listed);
    }
  }
}

TEST(GmEm, LikelihoodNeverFallsAndThreadsDoNotMatter) {
  const Kind kind;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  GmEmOptions options;
  options.components = 30;
  options.iterations = 12;
  const GmEmMixture start = gm_em_random(samples, options.components, 1);
  GmEmFit fits[2];
  for (const unsigned threads : {1u, 3u}) {
    run_on_threads(threads, [&] { fits[threads / 2] = gm_fit_em(samples, start, options); });
  }
  EXPECT_EQ(fits[0].mixture, fits[1].mixture);
  ASSERT_EQ(fits[0].log_likelihood.size(), 12u);
  for (std::size_t i = 1; i < 12; ++i) {
    EXPECT_GE(fits[0].log_likelihood[i], fits[0].log_likelihood[i - 1] - 1e-6) << i;
  }
  EXPECT_GT(fits[0].log_likelihood[11], fits[0].log_likelihood[0] + 1);
  // A checkpoint goes on where it was left.
  options.iterations = 6;
  const std::optional<GmEmFit> half = gm_em_fit_of(gm_em_state(gm_fit_em(samples, start, options)));
  ASSERT_TRUE(half);
  options.iterations = 12;
  EXPECT_EQ(gm_continue_em(samples, *half, options).mixture, fits[0].mixture);
  options.iterations = 100;
  options.epsilon = 0.05;
  EXPECT_LT(gm_fit_em(samples, start, options).iterations, 100u);
}

TEST(GmEm, SharesThatDifferReachTheSameLikelihood) {
  Kind kind;
  kind.width = kind.height = 32;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  GmEmOptions options;
  options.components = 20;
  options.iterations = 15;
  const GmEmMixture start = gm_em_random(samples, options.components, 1);
  const auto likelihood = [&](const GmEmMixture& mixture) {
    const GmEmSums all = gm_em_pass(samples, mixture, {});
    return all.log_likelihood / static_cast<double>(all.samples);
  };
  const double whole = likelihood(gm_fit_em(samples, start, options).mixture);
  options.every = 5;
  options.iterations = 45;
  EXPECT_GT(likelihood(gm_fit_em(samples, start, options).mixture), whole - 0.25);
}

TEST(GmEm, DeadComponentsAreSplitOffTheHeaviest) {
  const Kind kind;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  GmEmMixture mixture = gm_em_random(samples, 12, 1);
  mixture.weight[3] = 0;  // no sample sees it
  const double before = gm_em_pass(samples, mixture, {}).log_likelihood;
  const GmEmSums sums = gm_em_pass(samples, mixture, {});
  EXPECT_EQ(sums.sum[3], 0);
  EXPECT_EQ(gm_em_reseed(mixture, sums, 5), 1u);
  const GmEmSums after = gm_em_pass(samples, mixture, {});
  EXPECT_GT(after.sum[3], 5);
  EXPECT_GT(after.log_likelihood, before - 0.05 * static_cast<double>(after.samples));
  double weights = 0;
  for (const double w : mixture.weight) weights += w;
  EXPECT_NEAR(weights, 1, 1e-12);
}

TEST(GmEm, DecodedMixtureGivesTheConditionalExpectation) {
  const Kind kind;
  const Dataset dataset = make_dataset(kind, woven);
  const GmSamples samples = with_mean(dataset);
  const GmEmMixture mixture = gm_em_random(samples, 9, 2);
  const GmField field = gm_field(gm_em_decoded(mixture), kind.width, kind.height, true);
  GmQuery query{4.5f, 7.5f, samples.pairs[10]};
  float value[3];
  gm_evaluate_batch(field, {&query, 1}, {}, value);
  // Eqs 9 and 10 with all their factors.
  double total = 0, sums[3] = {};
  for (std::size_t m = 0; m < 9; ++m) {
    double density = mixture.weight[m];
    const double in[6] = {4.5,
                          7.5,
                          double{query.directions.angle[0]},
                          double{query.directions.angle[1]},
                          double{query.directions.angle[2]},
                          double{query.directions.angle[3]}};
    for (std::size_t n = 0; n < 6; ++n) {
      double t = in[n] - mixture.mean[n * 9 + m];
      const double period = n == 0 ? kind.width : kind.height;
      if (n < 2) t -= period * std::nearbyint(t / period);
      const double spread = mixture.spread[n * 9 + m];
      density *= std::exp(-0.5 * t * t / (spread * spread)) / (std::sqrt(2 * std::numbers::pi) * spread);
    }
    total += density;
    for (std::size_t c = 0; c < 3; ++c) sums[c] += density * mixture.mean[(6 + c) * 9 + m];
  }
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(static_cast<double>(value[c]), sums[c] / total, 1e-5);
}

}  // namespace
}  // namespace btfc::test
