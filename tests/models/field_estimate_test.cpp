// The analysis of random fields, part by part: pyramids, estimates, stability and its repair, neighbourhoods,
// marginal tables, colours, the bump filter's strength, signatures.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "encoder/fields/colour_factors.h"
#include "encoder/fields/laplacian_pyramid.h"
#include "encoder/fields/level_estimate.h"
#include "encoder/fields/marginal.h"
#include "encoder/fields/neighbourhood_choice.h"
#include "encoder/fields/recursion_stability.h"
#include "encoder/fields/relief_strength.h"
#include "encoder/models/field_records.h"
#include "format/models/field_collapse.h"
#include "format/models/field_response.h"
#include "format/models/field_torus.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

// Two passes, over all texels.
double variance_of(const FieldPlane& plane) {
  const double mean = mean_of(plane);
  double sum = 0;
  for (const double v : plane.values) sum += (v - mean) * (v - mean);
  return sum / static_cast<double>(plane.values.size());
}

template <class Value>
FieldPlane plane_of(std::uint32_t width, std::uint32_t height, const Value& value) {
  FieldPlane plane{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) plane.values.push_back(value(x, y));
  }
  return plane;
}

// White noise of variance 1.
FieldPlane white(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
  SplitMix64 random(seed);
  return plane_of(width, height,
                  [&](std::uint32_t, std::uint32_t) { return std::sqrt(12.0) * (random.uniform() - 0.5); });
}

std::uint64_t bit(int dx, int dy) {
  for (std::uint32_t s = 0; s < kFieldCandidates; ++s) {
    if (field_offset(s).dx == dx && field_offset(s).dy == dy) return std::uint64_t{1} << s;
  }
  return 0;
}

std::vector<FieldOffset> offsets_in(std::uint64_t mask) {
  std::vector<FieldOffset> out;
  for (std::uint32_t s = 0; s < kFieldCandidates; ++s) {
    if ((mask >> s & 1) != 0) out.push_back(field_offset(s));
  }
  return out;
}

// One band with these numbers, d channels in one recursion where d > 1.
struct Recursion {
  FieldShape shape;
  std::vector<float> numbers;
  Recursion(std::uint64_t mask, std::vector<float> given, std::uint32_t margin, std::uint32_t d = 1)
      : numbers(std::move(given)) {
    shape.kind = d > 1 ? FieldKind::car3d : FieldKind::car;
    shape.factors = d;
    shape.margins[0] = margin;
    shape.masks = {mask};
  }
  FieldBand band() const { return field_band(shape, 0, numbers.data()); }
  std::vector<FieldPlane> planes(std::uint32_t width, std::uint32_t height) const {
    std::vector<double> values(std::size_t{shape.factors} * width * height);
    field_synthesise_plain<double>(band(), 0, {0, 0, width, height}, values.data());
    std::vector<FieldPlane> out;
    for (std::size_t f = 0; f < shape.factors; ++f) {
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(f * width * height);
      out.push_back({width, height, {begin, begin + std::ptrdiff_t{width} * height}});
    }
    return out;
  }
};

// ---- Pyramids ----

// What the decoder makes of a pyramid, by spec/models/car.md section 5.4 in doubles, borders as asked for.
FieldPlane collapsed(const std::vector<FieldPlane>& pyramid, bool wraps) {
  FieldPlane out = pyramid.back();
  for (std::size_t l = pyramid.size() - 1; l-- > 0;) {
    const FieldPlane coarse = out;
    const auto fold = [&](std::int64_t at, std::uint32_t size) -> std::uint32_t {
      const auto n = static_cast<std::int64_t>(size);
      if (wraps) return static_cast<std::uint32_t>((at + n) % n);
      if (n == 1) return 0;
      at = std::abs(at);
      return static_cast<std::uint32_t>(at < n ? at : 2 * n - 2 - at);
    };
    const auto along = [&](std::uint32_t x, std::uint32_t j) {
      const std::int64_t i = x / 2;
      const double here = coarse.at(fold(i, coarse.width), j), next = coarse.at(fold(i + 1, coarse.width), j);
      return x % 2 == 1 ? (here + next) / 2 : (coarse.at(fold(i - 1, coarse.width), j) + 6 * here + next) / 8;
    };
    out = plane_of(pyramid[l].width, pyramid[l].height, [&](std::uint32_t x, std::uint32_t y) {
      const std::int64_t j = y / 2;
      const double here = along(x, fold(j, coarse.height)), next = along(x, fold(j + 1, coarse.height));
      return pyramid[l].at(x, y) +
             (y % 2 == 1 ? (here + next) / 2 : (along(x, fold(j - 1, coarse.height)) + 6 * here + next) / 8);
    });
  }
  return out;
}

TEST(FieldPyramid, CollapsesToTheOriginal) {
  for (const bool wraps : {false, true}) {
    for (const auto& [width, height] : {std::pair{64u, 48u}, std::pair{1u, 1u}, std::pair{37u, 1u},
                                        std::pair{1u, 20u}, std::pair{31u, 27u}, std::pair{2u, 3u}}) {
      const FieldPlane plane = white(width, height, 5);
      for (const std::uint32_t levels : {1u, 2u, 4u, 8u}) {
        const std::vector<FieldPlane> pyramid = laplacian_pyramid(plane, levels, wraps);
        ASSERT_EQ(pyramid.size(), levels);
        const FieldPlane back = collapsed(pyramid, wraps);
        for (std::size_t i = 0; i < plane.values.size(); ++i)
          ASSERT_NEAR(back.values[i], plane.values[i], 1e-12) << width << " " << height;
      }
    }
  }
}

TEST(FieldPyramid, LevelsAreBands) {
  // A constant is all in the coarsest level; the finest wave all but in the finest.
  const std::vector<FieldPlane> flat =
      laplacian_pyramid(plane_of(32, 32, [](auto, auto) { return 3.5; }), 3, false);
  for (std::size_t l = 0; l < 2; ++l)
    EXPECT_NEAR(variance_of(flat[l]) + std::fabs(mean_of(flat[l])), 0, 1e-12);
  for (const double v : flat[2].values) EXPECT_NEAR(v, 3.5, 1e-12);
  const std::vector<FieldPlane> wave =
      laplacian_pyramid(plane_of(32, 32, [](auto x, auto) { return x % 2 == 0 ? 1.0 : -1.0; }), 3, true);
  EXPECT_NEAR(variance_of(wave[0]), 1, 1e-12);
  EXPECT_NEAR(variance_of(wave[1]) + variance_of(wave[2]), 0, 1e-12);
}

// ---- Estimates ----

TEST(FieldEstimates, FindTheModelThatMadeAPlane) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1) | bit(-1, -1) | bit(1, -1) | bit(3, -4);
  // In raster order: (3, -4), (-1, -1), (0, -1), (1, -1), (-1, 0).
  const std::vector<float> numbers = {0.8f, 0.1f, -0.15f, 0.3f, 0.2f, 0.35f};
  const FieldPlane plane = Recursion(mask, numbers, 60).planes(256, 256)[0];
  const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, false);
  EXPECT_EQ(m.samples, 248.0 * 252);
  const std::vector<double> a = estimate_coefficients(m, mask);
  // Standard errors are about (1 - R^2)^1/2 / sqrt(samples) = 0.004.
  ASSERT_EQ(a.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(a[i], double{numbers[i + 1]}, 0.02) << i;
  EXPECT_NEAR(prediction_error(m, mask, a), 0.64, 0.02);
  // What is not there is found not to be.
  const std::vector<double> more = estimate_coefficients(m, mask | bit(4, -1) | bit(-3, 0));
  double largest = 0;
  const std::vector<FieldOffset> offsets = offsets_in(mask | bit(4, -1) | bit(-3, 0));
  for (std::size_t i = 0; i < more.size(); ++i) {
    if ((offsets[i].dx == 4 && offsets[i].dy == -1) || offsets[i].dx == -3)
      largest = std::max(largest, std::fabs(more[i]));
  }
  EXPECT_LT(largest, 0.02);
}

TEST(FieldEstimates, FindTheCoupledModelThatMadePlanes) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1);
  // L, then of (0, -1) and (-1, 0) a 2 x 2 matrix each, row by row.
  const std::vector<float> numbers = {1, 0.5f, 0.8f, 0.3f, 0.1f, -0.2f, 0.4f, 0.35f, 0, 0.25f, 0.1f};
  const std::vector<FieldPlane> planes = Recursion(mask, numbers, 60, 2).planes(256, 256);
  const NeighbourMoments m = neighbour_moments(planes, Neighbourhood::causal, false);
  const std::vector<double> a = estimate_coefficients(m, mask);
  ASSERT_EQ(a.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(a[i], double{numbers[i + 3]}, 0.03) << i;
  const MatrixD noise = residual_covariance(m, mask, a);
  EXPECT_NEAR(noise(0, 0), 1, 0.03);
  EXPECT_NEAR(noise(0, 1), 0.5, 0.03);
  EXPECT_NEAR(noise(1, 1), 0.25 + 0.64, 0.03);
}

// Markov fields: the texel given all neighbours has the coefficients of its torus.
TEST(FieldEstimates, FindTheMarkovFieldThatMadeATorus) {
  FieldShape shape;
  shape.kind = FieldKind::gmrf;
  shape.factors = 1;
  shape.torus_log2 = 8;
  shape.masks = {bit(-1, 0) | bit(0, -1)};
  const std::vector<float> numbers = {1, 0.2f, 0.15f};  // above, left
  std::vector<float> torus(256 * 256);
  ASSERT_TRUE(field_torus(field_band(shape, 0, numbers.data()), 0, 0, 256, torus.data()));
  const FieldPlane plane{256, 256, {torus.begin(), torus.end()}};
  const std::vector<double> a =
      estimate_coefficients(neighbour_moments({&plane, 1}, Neighbourhood::symmetric, true), shape.masks[0]);
  EXPECT_NEAR(a[0], 0.2, 0.02);
  EXPECT_NEAR(a[1], 0.15, 0.02);
}

TEST(FieldEstimates, TexelByTexelIsAllAtOnce) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1) | bit(1, -1);
  const FieldPlane plane = Recursion(mask, {1, 0.3f, 0.2f, 0.4f}, 40).planes(60, 50)[0];
  const double mean = mean_of(plane);
  const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, false);
  const std::vector<double> batch = estimate_coefficients(m, mask);
  // The batch's prior of 1e-6 of the variance is on means; here sums are added up.
  RecursiveEstimate recursive(3, 1e-6 * m.moments(m.own(), m.own()) * m.samples);
  for (std::uint32_t y = 4; y < 50; ++y) {
    for (std::uint32_t x = 4; x + 4 < 60; ++x) {
      Eigen::VectorXd neighbours(3);
      neighbours << plane.at(x, y - 1) - mean, plane.at(x + 1, y - 1) - mean, plane.at(x - 1, y) - mean;
      recursive.add(neighbours, plane.at(x, y) - mean);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(recursive.coefficients()(as_index(i)), batch[i], 1e-9);
  EXPECT_NEAR(recursive.prediction_error(), prediction_error(m, mask, batch), 1e-4);
}

// ---- Stability ----

double radius_of(std::uint64_t mask, const std::vector<double>& a, std::size_t d = 1) {
  return recursion_radius(offsets_in(mask), a, d);
}

TEST(FieldStability, KnownRadii) {
  EXPECT_EQ(radius_of(0, {}), 0);
  EXPECT_NEAR(radius_of(bit(-1, 0), {0.9}), 0.9, 1e-12);
  EXPECT_NEAR(radius_of(bit(0, -1), {0.9}), 0.9, 1e-12);
  EXPECT_NEAR(radius_of(bit(-1, -1), {-0.9}), 0.9, 1e-12);
  EXPECT_NEAR(radius_of(bit(4, -1), {0.9}), 0.9, 1e-12);
  EXPECT_NEAR(radius_of(bit(0, -4), {0.9 * 0.9 * 0.9 * 0.9}), 0.9, 1e-9);
  EXPECT_NEAR(radius_of(bit(-2, 0), {0.81}), 0.9, 1e-9);
  // Above, then left: sum 0.7, all of it at frequency 0: 0.4 / (1 - 0.3).
  EXPECT_NEAR(radius_of(bit(0, -1) | bit(-1, 0), {0.4, 0.3}), 0.4 / 0.7, 1e-9);
  EXPECT_NEAR(radius_of(bit(0, -1) | bit(-1, 0), {0.6, 0.5}), 1.2, 1e-9);
  EXPECT_NEAR(radius_of(bit(-1, 0), {1.1}), 1.1, 1e-12);
  EXPECT_NEAR(radius_of(bit(1, -1) | bit(-1, -1), {0.6, 0.6}), 1.2, 1e-9);
  // A sign that alternates: at the highest frequency.
  EXPECT_NEAR(radius_of(bit(1, -1) | bit(0, -1), {-0.6, 0.6}), 1.2, 1e-9);
  // Two channels: a rotation by 0.9, and one channel that feeds the other, which changes no root.
  EXPECT_NEAR(radius_of(bit(-1, 0), {0, -0.9, 0.9, 0}, 2), 0.9, 1e-12);
  EXPECT_NEAR(radius_of(bit(0, -1), {0.5, 100, 0, 0.5}, 2), 0.5, 1e-5);
}

TEST(FieldStability, ShrinkingMovesRootsTowardsZero) {
  SplitMix64 random(12);
  for (int i = 0; i < 40; ++i) {
    const std::uint64_t mask = random_mask(random, 1 + random.below(12));
    const std::vector<FieldOffset> offsets = offsets_in(mask);
    std::vector<double> a;
    for (std::size_t s = 0; s < offsets.size(); ++s) a.push_back(random.uniform() - 0.5);
    double before = radius_of(mask, shrunk(offsets, a, 1, 0.05));
    EXPECT_LT(before, 0.5);
    const double whole = radius_of(mask, a);
    if (std::isfinite(whole) && whole < 1) {
      EXPECT_LE(radius_of(mask, shrunk(offsets, a, 1, 0.7)), 0.9 + 1e-9);
    }
  }
}

LevelDemand demand_of(double variance, double error = 1e-3, std::size_t planes = 1) {
  LevelDemand demand;
  demand.variance.assign(planes, variance);
  demand.weight.assign(planes, 1);
  demand.error = error;
  return demand;
}

// A settled model keeps rule FD6 with its margin, and has the variance that was asked for.
void expect_sound(const LevelModel& m, std::uint64_t mask, double variance, std::uint32_t d = 1,
                  double within = 0.03) {
  EXPECT_LT(m.repaired_radius, 1);
  for (const float v : m.numbers) ASSERT_TRUE(std::isfinite(v));
  const Recursion r(mask, m.numbers, m.margin, d);
  const std::size_t plane = (m.margin + 1) * (2 * std::size_t{m.margin} + 1);
  std::vector<float> h(d * d * plane);
  const auto good = field_responses(r.band(), 0, h.data());
  ASSERT_TRUE(good) << good.error().message;
  double energy = 0;
  for (const float v : h) energy += double{v} * double{v};
  EXPECT_NEAR(energy / d, variance, within * variance + 1e-12);
}

TEST(FieldStability, UnstableEstimatesAreRepaired) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1);
  // Planes that grow: what predicts them does too.
  const FieldPlane growing = plane_of(64, 64, [](auto x, auto y) { return std::exp(0.08 * x + 0.02 * y); });
  const FieldPlane noisy = white(64, 64, 3);
  FieldPlane both = growing;
  for (std::size_t i = 0; i < both.values.size(); ++i) both.values[i] += noisy.values[i];
  for (const FieldPlane* plane : {&growing, static_cast<const FieldPlane*>(&both)}) {
    const NeighbourMoments m = neighbour_moments({plane, 1}, Neighbourhood::causal, false);
    const LevelModel model =
        settle_recursion(m, mask, demand_of(variance_of(*plane), 0.05 * std::sqrt(variance_of(*plane))));
    EXPECT_GE(model.radius, 1);
    EXPECT_LT(model.shrink, 1);
    EXPECT_GT(model.shrink, 0.5);
    EXPECT_GE(model.likelihood_lost, 0);
    expect_sound(model, mask, variance_of(*plane));
  }
}

TEST(FieldStability, AStableEstimateIsKept) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1);
  const FieldPlane plane = Recursion(mask, {1, 0.4f, 0.3f}, 60).planes(128, 128)[0];
  const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, false);
  const LevelModel model = settle_recursion(m, mask, demand_of(2));
  EXPECT_EQ(model.shrink, 1);
  EXPECT_EQ(model.likelihood_lost, 0);
  const std::vector<double> raw = estimate_coefficients(m, mask);
  EXPECT_NEAR(double{model.numbers[1]}, raw[0], 5e-4);  // of binary16
  EXPECT_NEAR(double{model.numbers[2]}, raw[1], 5e-4);
  EXPECT_LE(model.tail[model.margin], 1e-3);
  EXPECT_GT(model.tail[model.margin - 1], 1e-3) << "no margin larger than asked for";
  expect_sound(model, mask, 2);
}

// The nearer to a root of 1, the more a recursion is shrunk; it is never refused.
TEST(FieldStability, NextToTheUnitCircle) {
  const std::uint64_t mask = bit(-1, 0);
  for (const double a : {0.9, 0.99, 0.999, 0.9999, 0.999999, 1.0, -0.9999, 1.01}) {
    NeighbourMoments m;
    m.moments = MatrixD::Zero(41, 41);
    m.samples = 4096;
    m.moments(39, 39) = m.moments(40, 40) = 1;
    m.moments(39, 40) = m.moments(40, 39) = a;
    const LevelModel model = settle_recursion(m, mask, demand_of(1, 1e-2));
    EXPECT_NEAR(model.radius, std::fabs(a), 1e-5);
    if (std::fabs(a) >= 0.99) {
      EXPECT_LT(model.shrink, 1) << a;
      EXPECT_GT(model.shrink, 0.9) << a;
    } else {
      EXPECT_EQ(model.shrink, 1) << a;
    }
    expect_sound(model, mask, 1);
  }
}

TEST(FieldStability, NothingToModel) {
  const std::uint64_t mask = nearest_candidates(12);
  for (const double value : {0.0, 0.5, 0.3, 65504.0, -1e-30}) {
    const FieldPlane flat = plane_of(40, 40, [&](auto, auto) { return value; });
    const NeighbourMoments m = neighbour_moments({&flat, 1}, Neighbourhood::causal, false);
    // A mean's last bit may be left of a constant; its spread is none.
    const double rest = 1e-12 * std::fabs(value);
    const LevelModel model = settle_recursion(m, mask, demand_of(variance_of(flat)));
    expect_sound(model, mask, variance_of(flat), 1, 1e6);
    EXPECT_LE(model.numbers[0], rest);
    const LevelModel markov = settle_markov(neighbour_moments({&flat, 1}, Neighbourhood::symmetric, false),
                                            mask, 64, demand_of(variance_of(flat)));
    EXPECT_LE(markov.numbers[0], rest);
    EXPECT_LT(markov.repaired_radius, 1);
    if (value == 0.5) {
      for (const float v : model.numbers) EXPECT_EQ(v, 0.0f);
      for (const float v : markov.numbers) EXPECT_EQ(v, 0.0f);
      EXPECT_EQ(model.margin, 4u);
    }
  }
}

// A plane without noise: every texel follows from its neighbours, and V_x is singular.
TEST(FieldStability, PlanesThatPredictThemselves) {
  for (const std::uint64_t mask : {nearest_candidates(1), nearest_candidates(12), nearest_candidates(40)}) {
    for (const FieldPlane& plane :
         {plane_of(64, 64, [](auto x, auto) { return x % 4 < 2 ? 1.0 : -1.0; }),
          plane_of(64, 64, [](auto x, auto y) { return (x + y) % 2 == 0 ? 1.0 : -1.0; }),
          plane_of(64, 64, [](auto x, auto y) { return std::sin(0.3 * x + 0.2 * y); })}) {
      const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, true);
      const double variance = variance_of(plane);
      const LevelModel model = settle_recursion(m, mask, demand_of(variance, 0.02));
      expect_sound(model, mask, variance);
      const LevelModel markov = settle_markov(neighbour_moments({&plane, 1}, Neighbourhood::symmetric, true),
                                              mask, 64, demand_of(variance));
      EXPECT_LT(markov.repaired_radius, 1);
      for (const float v : markov.numbers) ASSERT_TRUE(std::isfinite(v));
    }
  }
}

TEST(FieldStability, MarkovFieldsHaveTheVarianceAskedFor) {
  const FieldPlane plane = Recursion(bit(-1, 0) | bit(0, -1), {1, 0.45f, 0.45f}, 120).planes(128, 128)[0];
  const std::uint64_t mask = nearest_candidates(6);
  const LevelModel model =
      settle_markov(neighbour_moments({&plane, 1}, Neighbourhood::symmetric, false), mask, 64, demand_of(3));
  FieldShape shape;
  shape.kind = FieldKind::gmrf;
  shape.factors = 1;
  shape.torus_log2 = 6;
  shape.masks = {mask};
  double sum = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    shape.seed = seed;
    std::vector<float> torus(64 * 64);
    ASSERT_TRUE(field_torus(field_band(shape, 0, model.numbers.data()), 0, 0, 64, torus.data()));
    for (const float v : torus) sum += double{v} * double{v};
  }
  EXPECT_NEAR(sum / (20 * 64 * 64) / 3, 1, 0.25);  // few long waves: hardly averaged
}

TEST(FieldStability, CoupledEstimatesAreRepaired) {
  const std::uint64_t mask = nearest_candidates(4);
  std::vector<FieldPlane> planes = {plane_of(64, 64, [](auto x, auto) { return std::exp(0.06 * x); }),
                                    white(64, 64, 8)};
  for (std::size_t i = 0; i < planes[0].values.size(); ++i) planes[0].values[i] += 0.01 * planes[1].values[i];
  const NeighbourMoments m = neighbour_moments(planes, Neighbourhood::causal, false);
  LevelDemand demand = demand_of(1, 0.1, 2);
  const LevelModel model = settle_recursion(m, mask, demand);
  EXPECT_GE(model.radius, 1);
  EXPECT_LT(model.shrink, 1);
  expect_sound(model, mask, 1, 2);
}

// ---- Neighbourhoods ----

int count_of(std::uint64_t mask) { return __builtin_popcountll(mask); }

TEST(FieldNeighbourhoods, EvidenceFindsTheModel) {
  const std::uint64_t mask = bit(-1, 0) | bit(0, -1) | bit(2, -3);
  const FieldPlane plane = Recursion(mask, {1, 0.25f, 0.3f, 0.35f}, 60).planes(128, 128)[0];
  const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, false);
  const std::uint64_t chosen = choose_neighbourhood({&m, 1}, std::nullopt, 40);
  EXPECT_EQ(chosen & mask, mask);
  EXPECT_LE(count_of(chosen), 6);
  const NeighbourMoments none = [&] {
    const FieldPlane noise = white(128, 128, 77);
    return neighbour_moments({&noise, 1}, Neighbourhood::causal, false);
  }();
  EXPECT_LE(count_of(choose_neighbourhood({&none, 1}, std::nullopt, 40)), 2);
  EXPECT_EQ(choose_neighbourhood({&none, 1}, 0u, 40), 0u);
  EXPECT_EQ(choose_neighbourhood({&m, 1}, 1u, 40), bit(-1, 0)) << "the most telling neighbour";
}

TEST(FieldNeighbourhoods, OrdersAreKept) {
  for (const FieldPlane& plane :
       {white(64, 64, 3), plane_of(64, 64, [](auto, auto) { return 1.0; }),
        plane_of(1, 1, [](auto, auto) { return 1.0; }),
        plane_of(64, 64, [](auto x, auto) { return static_cast<double>(x % 2); })}) {
    const NeighbourMoments m = neighbour_moments({&plane, 1}, Neighbourhood::causal, false);
    for (const std::uint32_t order : {0u, 1u, 2u, 7u, 39u, 40u})
      EXPECT_EQ(count_of(choose_neighbourhood({&m, 1}, order, 40)), static_cast<int>(order));
    EXPECT_LE(count_of(choose_neighbourhood({&m, 1}, std::nullopt, 5)), 5);
  }
}

// ---- Marginals ----

TEST(FieldMarginals, ScoresAndTablesUndoEachOther) {
  SplitMix64 random(4);
  const FieldPlane plane = plane_of(200, 200, [&](auto, auto) { return std::pow(random.uniform(), 3); });
  const FieldPlane scores = normal_scores(plane);
  EXPECT_NEAR(mean_of(scores), 0, 1e-9);
  EXPECT_NEAR(variance_of(scores), 1, 2e-3);
  const std::vector<float> table = marginal_table(plane, 64);
  ASSERT_EQ(table.size(), 64u);
  ASSERT_TRUE(std::is_sorted(table.begin(), table.end()));
  for (std::size_t i = 0; i < plane.values.size(); i += 37) {
    const double at = std::clamp((scores.values[i] + 3) * 63 / 6, 0.0, 63.0);
    const auto k = std::min<std::size_t>(static_cast<std::size_t>(at), 62);
    const double back =
        double{table[k]} + (at - static_cast<double>(k)) * (double{table[k + 1]} - double{table[k]});
    ASSERT_NEAR(back, plane.values[i], 0.01);
  }
  // Steepest: no chord of the table is steeper.
  const double most = steepest(table);
  for (std::size_t i = 1; i < 64; ++i)
    EXPECT_LE((double{table[i]} - double{table[i - 1]}) * 63 / 6, most * (1 + 1e-6));
  EXPECT_GT(most, 0);
}

TEST(FieldMarginals, TwoValuesAndOne) {
  const FieldPlane two = plane_of(10, 10, [](auto x, auto) { return x < 3 ? 0.25 : 0.75; });
  const FieldPlane scores = normal_scores(two);
  for (std::size_t i = 0; i < 100; ++i) {
    // 30 of rank 15 of 100, 70 of rank 65.
    EXPECT_NEAR(scores.values[i], two.values[i] < 0.5 ? -1.0364334 : 0.3853205, 1e-6);
  }
  const std::vector<float> table = marginal_table(two, 5);  // scores -3, -1.5, 0, 1.5, 3
  EXPECT_EQ(table, (std::vector<float>{0.25f, 0.25f, 0.75f, 0.75f, 0.75f}));
  const FieldPlane one = plane_of(7, 1, [](auto, auto) { return 0.125; });
  for (const double v : normal_scores(one).values) EXPECT_EQ(v, 0);
  EXPECT_EQ(marginal_table(one, 2), (std::vector<float>{0.125f, 0.125f}));
  EXPECT_EQ(steepest(marginal_table(one, 64)), 0);
}

// ---- Colours ----

TEST(FieldColours, FactorsAreUncorrelatedAndGiveTheChannelsBack) {
  const FieldPlane a = white(50, 40, 1), b = white(50, 40, 2);
  std::vector<FieldPlane> channels(4, a);
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    channels[1].values[i] = 3 + 0.5 * a.values[i] + 0.2 * b.values[i];
    channels[2].values[i] = -1 - b.values[i];
    channels[3].values[i] = 7;
  }
  const ColourFactors c = colour_factors(channels, std::nullopt);
  EXPECT_NEAR((c.basis.transpose() * c.basis - MatrixD::Identity(4, 4)).norm(), 0, 1e-12);
  for (std::size_t n = 0; n < 4; ++n) {
    for (std::size_t i = 0; i < a.values.size(); i += 7) {
      double sum = c.mean[n];
      for (std::size_t f = 0; f < 4; ++f) sum += c.basis(as_index(n), as_index(f)) * c.factors[f].values[i];
      ASSERT_NEAR(sum, channels[n].values[i], 1e-10);
    }
  }
  for (std::size_t f = 0; f < 4; ++f) {
    if (f > 0) {
      EXPECT_GE(variance_of(c.factors[f - 1]), variance_of(c.factors[f]) - 1e-12) << "by falling variance";
    }
    EXPECT_GE(c.basis.col(as_index(f)).sum(), -1e-12);
    for (std::size_t g = 0; g < f; ++g) {
      double product = 0;
      for (std::size_t i = 0; i < a.values.size(); ++i)
        product += c.factors[f].values[i] * c.factors[g].values[i];
      EXPECT_NEAR(product / static_cast<double>(a.values.size()), 0, 1e-10);
    }
  }
  EXPECT_NEAR(variance_of(c.factors[2]) + variance_of(c.factors[3]), 0, 1e-12) << "two sources, two factors";
  // Signs are those of another basis.
  const ColourFactors turned = colour_factors(channels, MatrixD(-c.basis));
  EXPECT_NEAR((turned.basis + c.basis).norm(), 0, 1e-12);
}

// ---- The bump filter's strength ----

TEST(FieldReliefStrength, IsFound) {
  constexpr std::uint32_t kRange = 16, kSide = 32;
  std::vector<float> heights;
  for (std::uint32_t y = 0; y < kRange; ++y) {
    for (std::uint32_t x = 0; x < kRange; ++x)
      heights.push_back(1.2f * static_cast<float>(std::sin(2 * std::numbers::pi * x / 8.0) +
                                                  std::cos(2 * std::numbers::pi * y / 16.0)));
  }
  const std::vector<std::array<float, 3>> lights = {{0.5f, 0, 0.866f}, {0, 0.6f, 0.8f}, {-0.6f, 0, 0.8f}};
  // The filter, as the decoder has it.
  std::vector<std::uint32_t> slot = {0};
  for (const float h : heights) slot.push_back(std::bit_cast<std::uint32_t>(h));
  const BtfcWords words = {{slot.data(), nullptr, nullptr, nullptr}};
  FieldParams p{};
  p.width = p.height = kSide;
  p.range_size = kRange | kRange << 16;
  for (const double strength : {0.0, 0.35, 0.8}) {
    const FieldPlane noise = white(kSide, kSide, 6);
    std::vector<std::vector<FieldPlane>> images;
    for (const auto& light : lights) {
      images.push_back({plane_of(kSide, kSide, [&](std::uint32_t x, std::uint32_t y) {
        const float shade = field_slope_shade(
            field_slopes(words, p, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f),
            vec3(light[0], light[1], light[2]));
        return (0.5 + 0.01 * noise.at(x, y)) * (1 + strength * (double{shade} - 1));
      })});
    }
    EXPECT_NEAR(take_relief_off(heights, kRange, kRange, lights, images), strength, 0.051);
    for (const auto& image : images) EXPECT_LT(std::sqrt(variance_of(image[0])), 0.02) << "the filter is off";
  }
  // Level ground bears no filter.
  std::vector<std::vector<FieldPlane>> images = {{white(kSide, kSide, 9)}};
  const std::vector<FieldPlane> before = images[0];
  EXPECT_EQ(
      take_relief_off(std::vector<float>(kRange * kRange, 3.0f), kRange, kRange, {lights.data(), 1}, images),
      0.0f);
  EXPECT_EQ(images[0][0].values, before[0].values);
}

// ---- Signatures ----

TEST(FieldSignatures, SayHowSubspacesGoTogether) {
  FieldRecipe recipe;
  recipe.clusters = 4;
  recipe.rings = 1;
  recipe.channels = {2};
  MadeField made = make_field(recipe);
  // Subspace 1 is 0, 2 its negative, 3 has no noise.
  const auto copy = [&](std::size_t to, float sign, float scale) {
    const std::size_t record = made.shape.record_numbers();
    std::copy_n(made.payload.records.begin(), record,
                made.payload.records.begin() + static_cast<std::ptrdiff_t>(to * record));
    for (std::size_t i = 0; i < 4; ++i) made.payload.records[made.basis_at(to) + i] *= sign;
    for (std::vector<float>& level : made.payload.levels) {
      const std::size_t n = level.size() / 4;
      for (std::size_t i = 0; i < n; ++i) level[to * n + i] = level[i];
      level[to * n] *= scale;
      level[to * n + n / 2] *= scale;
    }
  };
  copy(1, 1, 1);
  copy(2, -1, 1);
  copy(3, 1, 0);
  const LoadedField f = loaded(file_of(made));
  const auto s = subspace_signatures(f.item, f.p);
  ASSERT_EQ(s.size(), 4u);
  double length = 0, same = 0, opposite = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    length += double{s[0][i]} * double{s[0][i]};
    same += double{s[0][i]} * double{s[1][i]};
    opposite += double{s[0][i]} * double{s[2][i]};
    EXPECT_NEAR(s[3][i], 0, 1e-6);
  }
  // Of all channels together: the variances of both factors.
  double variance = 0;
  for (std::uint32_t factor = 0; factor < 2; ++factor)
    variance += factor_variances(f.item, f.p, 0, factor)[0];
  EXPECT_NEAR(length / variance, 1, 0.15);
  EXPECT_NEAR(same / length, 1, 1e-5);
  EXPECT_NEAR(opposite / length, -1, 1e-5);
  for (const auto& own : s) EXPECT_NEAR(own[3], 0, 1e-3 * std::sqrt(length));
}

}  // namespace
}  // namespace btfc::test
