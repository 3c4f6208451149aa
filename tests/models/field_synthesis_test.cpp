// Random fields below the decoder: noise, recursions in vectors against plain ones, impulse responses, tori,
// and the pyramid's collapse.
#include "format/models/field_synthesis.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstring>
#include <numbers>
#include <set>
#include <vector>

#include "format/models/field_collapse.h"
#include "format/models/field_response.h"
#include "format/models/field_torus.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::uint32_t kShare = 4;  // of the counts: everything is slower
#else
constexpr std::uint32_t kShare = 1;
#endif

constexpr std::int64_t kTurn = std::int64_t{1} << 32;

double unit_noise(std::uint32_t x, std::uint32_t y, std::uint32_t stream) {
  return static_cast<double>(field_noise_integer(x, y, stream)) * double{FIELD_NOISE_UNIT};
}

// ---- Noise (spec/models/car.md section 4) ----

// Worked out from the page by another program.
TEST(FieldNoise, FixedValues) {
  struct Case {
    std::uint32_t seed, x, y, level, factor;
    int e;
  };
  constexpr Case kCases[] = {{1u, 0u, 0u, 0u, 0u, 265869},
                             {1u, 1u, 0u, 0u, 0u, 274745},
                             {1u, 0u, 1u, 0u, 0u, -99605},
                             {7u, 4294967295u, 5u, 2u, 1u, -102381},
                             {4294967295u, 2147483648u, 2147483647u, 7u, 15u, 68646},
                             {12345u, 1000000u, 999u, 3u, 4u, -227413}};
  for (const Case& c : kCases)
    EXPECT_EQ(field_noise_integer(c.x, c.y, field_stream(c.seed, c.level, c.factor)), c.e);
}

TEST(FieldNoise, Moments) {
  constexpr std::uint32_t kSide = 1024 / kShare;
  const std::uint32_t stream = field_stream(1, 0, 0);
  const std::array<std::uint32_t, 4> others = {field_stream(1, 1, 0), field_stream(1, 0, 1),
                                               field_stream(2, 0, 0), field_stream(1, 1, 1)};
  constexpr std::array<std::array<std::uint32_t, 2>, 5> kLags = {{{1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 3}}};
  double sum = 0, squares = 0, fourth = 0;
  std::array<double, 4> with_other{};
  std::array<double, 5> with_lag{};
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const double e = unit_noise(x, y, stream);
      ASSERT_LT(std::fabs(e), 5.949);
      sum += e;
      squares += e * e;
      fourth += e * e * e * e;
      for (std::size_t i = 0; i < others.size(); ++i) with_other[i] += e * unit_noise(x, y, others[i]);
      for (std::size_t i = 0; i < kLags.size(); ++i)
        with_lag[i] += e * unit_noise(x + kLags[i][0], y + kLags[i][1], stream);
    }
  }
  // Means of n products of variance about 1 are off by 1 / sqrt(n); 4.5 of these, 1 in 10^5 each.
  constexpr double kCount = double{kSide} * kSide, kBound = 4.5 / kSide;
  EXPECT_NEAR(sum / kCount, 0, kBound);
  EXPECT_NEAR(squares / kCount, 1, 1.5 * kBound);
  // Of the binomial part, 8 of 8 1/6 of the variance: kurtosis 3 - 2 / 32 of it; the rest is smaller still.
  EXPECT_NEAR(fourth / kCount, 2.94, 15 * kBound);
  for (std::size_t i = 0; i < others.size(); ++i)
    EXPECT_NEAR(with_other[i] / kCount, 0, kBound) << "other " << i;
  for (std::size_t i = 0; i < kLags.size(); ++i) EXPECT_NEAR(with_lag[i] / kCount, 0, kBound) << "lag " << i;
}

TEST(FieldNoise, StreamsDiffer) {
  std::set<std::uint32_t> streams;
  for (std::uint32_t l = 0; l < kFieldMostLevels; ++l) {
    for (std::uint32_t g = 0; g < FIELD_MOST_FACTORS; ++g) streams.insert(field_stream(12345, l, g));
  }
  EXPECT_EQ(streams.size(), std::size_t{kFieldMostLevels} * FIELD_MOST_FACTORS);
}

// ---- Recursions ----

// A level of given neighbourhoods with records of some subspaces.
struct Level {
  FieldShape shape;
  std::vector<float> numbers;
  std::uint32_t level = 0, period = 0;
  FieldBand band() const {
    FieldBand b = field_band(shape, level, numbers.data());
    b.period = period;
    return b;
  }
};

Level random_level(SplitMix64& random, FieldKind kind, std::uint32_t factors, std::uint32_t subspaces,
                   std::uint32_t order, std::uint32_t margin, std::uint32_t level, double whole) {
  Level out;
  FieldShape& s = out.shape;
  s.kind = kind;
  s.factors = factors;
  s.clusters = subspaces;
  s.levels = level + 1;
  s.seed = static_cast<std::uint32_t>(random.next());
  s.margins[level] = margin;
  out.level = level;
  for (std::uint32_t i = 0; i < s.levels * s.masks_per_level(); ++i)
    s.masks.push_back(random_mask(random, order));
  const double scale = whole / std::max(1.0, static_cast<double>(order) * (s.coupled() ? factors : 1)) * 2;
  for (std::uint32_t i = 0; i < subspaces * s.level_numbers(level); ++i)
    out.numbers.push_back(static_cast<float>(scale * (random.uniform() - 0.5)));
  return out;
}

void expect_fast_is_plain(const Level& l, std::span<const std::uint32_t> subspaces, const FieldWindow& window,
                          const std::string& what) {
  const FieldBand band = l.band();
  const std::size_t planes = l.shape.factors * window.texels();
  std::vector<float> fast(subspaces.size() * planes, 7.0f), plain(planes);
  field_synthesise(band, subspaces, window, fast.data());
  for (std::size_t k = 0; k < subspaces.size(); ++k) {
    field_synthesise_plain<float>(band, subspaces[k], window, plain.data());
    ASSERT_EQ(std::memcmp(&fast[k * planes], plain.data(), planes * sizeof(float)), 0)
        << what << ", subspace " << subspaces[k];
  }
}

// Every shape of window, neighbourhood and place, under every vector width that this machine has.
TEST(FieldSynthesis, VectorsAreThePlainRecursionBitForBit) {
  constexpr std::array<std::uint32_t, 4> kOrders = {0, 1, 12, 40};
  constexpr std::array<std::int64_t, 8> kPlaces = {
      0,          -1,         -77,          (std::int64_t{1} << 31) - 9, -(std::int64_t{1} << 31),
      kTurn - 13, -kTurn - 5, 3 * kTurn + 2};
  const std::int64_t all = hwy::SupportedTargets();
  for (std::int64_t target = all & -all, rest = all; rest != 0; rest &= rest - 1, target = rest & -rest) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    SplitMix64 random(11);
    for (std::uint32_t i = 0; i < 160 / kShare; ++i) {
      const bool coupled = random.below(3) == 0;
      const std::uint32_t factors = coupled ? 1 + random.below(5) : 1 + random.below(3),
                          subspaces = 1 + random.below(7);
      const std::uint32_t order = kOrders[i % 4], margin = 4 + random.below(37), level = random.below(4);
      Level l = random_level(random, coupled ? FieldKind::car3d : FieldKind::car, factors, subspaces, order,
                             margin, level, 0.95);
      constexpr std::array<std::uint32_t, 4> kPeriods = {0, 8, 24, 1 << 20};
      l.period = kPeriods[random.below(4)];
      const FieldWindow window{kPlaces[random.below(8)], kPlaces[random.below(8)], 1 + random.below(70),
                               1 + random.below(40)};
      std::vector<std::uint32_t> of;
      for (std::uint32_t k = subspaces; k-- > 0;) {
        if (k == 0 || random.below(3) != 0) of.push_back(k);  // some of them, the last first
      }
      expect_fast_is_plain(
          l, of, window,
          fmt::format("target {}, {} factors, order {}, margin {}, level {}, period {}, window {} {} {} {}",
                      hwy::TargetName(target), factors, order, margin, level, l.period, window.x, window.y,
                      window.width, window.height));
      if (HasFatalFailure()) break;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

TEST(FieldSynthesis, LatticesCloseOnThemselves) {
  SplitMix64 random(3);
  for (const std::uint32_t level : {0u, 1u, 3u}) {
    Level l = random_level(random, FieldKind::car, 2, 1, 12, 16, level, 0.5);
    const std::int64_t turn = kTurn >> level;
    const std::uint32_t subspaces[] = {0};
    const auto values = [&](std::int64_t x, std::int64_t y, std::uint32_t w, std::uint32_t h) {
      std::vector<float> out(2 * std::size_t{w} * h);
      field_synthesise(l.band(), subspaces, {x, y, w, h}, out.data());
      return out;
    };
    EXPECT_EQ(values(turn - 10, -20, 30, 30), values(-10, turn - 20, 30, 30)) << level;
    EXPECT_EQ(values(-turn - 3, 5, 9, 9), values(-3, 5, 9, 9)) << level;
    l.period = 96u << level;
    EXPECT_EQ(values(-5, 40, 20, 20), values(91, 40 - 96, 20, 20)) << level;
    EXPECT_NE(values(-5, 40, 20, 20), values(90, 40, 20, 20)) << level;
  }
}

// What margins leave out falls with them, and arithmetic in binary32 adds next to nothing.
TEST(FieldSynthesis, MarginsAgainstDoubles) {
  SplitMix64 random(5);
  for (const FieldKind kind : {FieldKind::car, FieldKind::car3d}) {
    Level l = random_level(random, kind, 2, 1, 12, 255, 0, 0);
    // A recursion that dies away slowly: 0.84 in all.
    std::fill(l.numbers.begin(), l.numbers.end(), kind == FieldKind::car ? 0.07f : 0.035f);
    const FieldWindow window{100, -50, 40, 20};
    std::vector<double> exact(2 * window.texels());
    field_synthesise_plain<double>(l.band(), 0, window, exact.data());
    const std::uint32_t subspaces[] = {0};
    double before = 1e9;
    for (const std::uint32_t margin : {4u, 16u, 32u, 64u, 128u, 255u}) {
      l.shape.margins[0] = margin;
      std::vector<float> out(exact.size());
      field_synthesise(l.band(), subspaces, window, out.data());
      double worst = 0, largest = 0;
      for (std::size_t i = 0; i < out.size(); ++i) {
        worst = std::max(worst, std::fabs(double{out[i]} - exact[i]));
        largest = std::max(largest, std::fabs(exact[i]));
      }
      if (margin <= 128) {
        EXPECT_LT(worst, 0.6 * before) << margin;
      }
      if (margin == 4) {
        EXPECT_GT(worst, 0.05 * largest) << "too small a margin shows";
      }
      if (margin == 255) {
        EXPECT_LT(worst, 2e-6 * largest);
      }
      before = worst;
    }
  }
}

// ---- Impulse responses (section 5.3) ----

// One recursion of one factor and one neighbour.
Level one_neighbour(std::uint32_t candidate, float a, float spread, std::uint32_t margin) {
  Level l;
  l.shape.factors = 1;
  l.shape.margins[0] = margin;
  l.shape.masks = {std::uint64_t{1} << candidate};
  l.numbers = {spread, a};
  return l;
}

TEST(FieldResponse, PowersOfOneCoefficient) {
  constexpr std::uint32_t kMargin = 20;
  constexpr std::int64_t kWidth = 2 * kMargin + 1;
  // Candidates, and where the response goes: away from the neighbour.
  constexpr std::array<std::array<int, 3>, 5> kCases = {
      {{39, 1, 0}, {31, 0, 1}, {30, 1, 1}, {32, -1, 1}, {0, 4, 4}}};
  for (const auto& [candidate, dx, dy] : kCases) {
    const Level l = one_neighbour(static_cast<std::uint32_t>(candidate), 0.5f, 3.0f, kMargin);
    std::vector<float> h((kMargin + 1) * kWidth), expected(h.size());
    ASSERT_TRUE(field_responses(l.band(), 0, h.data()));
    float power = 3;
    for (int i = 0; std::abs(i * dx) <= int{kMargin} && i * dy <= int{kMargin}; ++i, power *= 0.5f)
      expected[static_cast<std::size_t>(i * dy * kWidth + i * dx + kMargin)] = power;
    EXPECT_EQ(h, expected) << candidate;
  }
}

TEST(FieldResponse, WhatDoesNotDieAwayIsRefused) {
  std::vector<float> h(256 * 511);
  EXPECT_TRUE(field_responses(one_neighbour(39, 0.5f, 1, 12).band(), 0, h.data()));
  for (const float a : {1.0f, -1.0f, 1.5f, 0.999f}) {
    const auto refused = field_responses(one_neighbour(39, a, 1, 40).band(), 0, h.data());
    ASSERT_FALSE(refused) << a;
    EXPECT_STREQ(refused.error().rule, "FD6");
  }
  // 0.9^k: the last four rings of a margin m hold 0.9^(m - 3) (1 - 0.9^4) / 0.1, and (1 + 0.9) times that is
  // 1/2 between 27 and 28.
  EXPECT_FALSE(field_responses(one_neighbour(39, 0.9f, 1, 26).band(), 0, h.data()));
  EXPECT_TRUE(field_responses(one_neighbour(39, 0.9f, 1, 28).band(), 0, h.data()));
}

// Sums of noises under responses are what recursions give.
TEST(FieldResponse, DirectSumsAreTheRecursion) {
  for (const ModelId model : {ModelId::car, ModelId::car3d}) {
    FieldRecipe recipe;
    recipe.model = model;
    recipe.levels = 1;
    recipe.clusters = 1;
    recipe.spread = 1;
    const LoadedField f = loaded(file_of(make_field(recipe)));
    const FieldWindow window{-7, 1000, 12, 9};
    const std::uint32_t subspaces[] = {0};
    std::vector<float> values(3 * window.texels());
    field_band_values(f.item, f.p, 0, subspaces, window, values.data());
    for (std::uint32_t factor = 0; factor < 3; ++factor) {
      for (std::uint32_t i = 0; i < window.texels(); ++i) {
        const auto x = static_cast<std::uint32_t>(window.x + i % window.width),
                   y = static_cast<std::uint32_t>(window.y + i / window.width);
        EXPECT_NEAR(field_band(f.words(), f.p, 0, factor, 0, x, y), values[factor * window.texels() + i],
                    2e-5);
      }
    }
  }
}

// car3d with one channel is car.
TEST(FieldSynthesis, OneCoupledChannelIsAScalarField) {
  SplitMix64 random(8);
  Level scalar = random_level(random, FieldKind::car, 1, 1, 12, 20, 0, 0.9), coupled = scalar;
  coupled.shape.kind = FieldKind::car3d;
  const FieldWindow window{3, -8, 37, 21};
  std::vector<float> a(window.texels()), b(a.size());
  const std::uint32_t subspaces[] = {0};
  field_synthesise(scalar.band(), subspaces, window, a.data());
  field_synthesise(coupled.band(), subspaces, window, b.data());
  EXPECT_EQ(a, b);
}

// ---- Tori (spec/models/gmrf.md) ----

constexpr std::uint32_t kSide = 16;

// The transform of a square, by its definition.
std::vector<std::complex<double>> transformed(const std::vector<double>& values) {
  std::vector<std::complex<double>> out(values.size());
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      std::complex<double> sum = 0;
      for (std::uint32_t t = 0; t < kSide * kSide; ++t)
        sum +=
            values[t] * std::polar(1.0, -2 * std::numbers::pi * (j * (t % kSide) + i * (t / kSide)) / kSide);
      out[i * kSide + j] = sum;
    }
  }
  return out;
}

TEST(FieldTorus, HasTheSpectrumAskedFor) {
  Level l;
  l.shape.kind = FieldKind::gmrf;
  l.shape.factors = 1;
  l.shape.torus_log2 = 4;
  l.shape.masks = {std::uint64_t{1} << 39 | std::uint64_t{1} << 31 |
                   std::uint64_t{1} << 20};  // left, above, (-2, -2)
  l.numbers = {0.7f, 0.1f, 0.2f, 0.15f};     // in raster order: (-2, -2), above, left
  std::vector<float> torus(kSide * kSide);
  ASSERT_TRUE(field_torus(l.band(), 0, 0, kSide, torus.data()));
  std::vector<double> noise;
  for (std::uint32_t i = 0; i < kSide * kSide; ++i)
    noise.push_back(unit_noise(i % kSide, i / kSide, field_stream(1, 0, 0)));
  const auto f = transformed(noise), y = transformed({torus.begin(), torus.end()});
  EXPECT_NEAR(std::abs(y[0]), 0, 1e-4);
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      if (i + j == 0) continue;
      const double u = 2 * std::numbers::pi * j / kSide, v = 2 * std::numbers::pi * i / kSide;
      const double d = 1 - 2 * (double{0.1f} * std::cos(-2 * u - 2 * v) + double{0.2f} * std::cos(v) +
                                double{0.15f} * std::cos(u));
      const std::complex<double> expected = double{0.7f} * f[i * kSide + j] / std::sqrt(d);
      EXPECT_NEAR(std::abs(y[i * kSide + j] - expected), 0, 1e-4) << i << " " << j;
    }
  }
}

TEST(FieldTorus, SpectraThatAreNotPositiveAreRefused) {
  Level l;
  l.shape.kind = FieldKind::gmrf;
  l.shape.factors = 1;
  l.shape.torus_log2 = 4;
  l.shape.masks = {std::uint64_t{1} << 39};
  std::vector<float> torus(kSide * kSide);
  for (const float a : {0.5f, 0.6f, -0.5f}) {
    l.numbers = {1, a};
    const auto refused = field_torus(l.band(), 0, 0, kSide, torus.data());
    ASSERT_FALSE(refused) << a;
    EXPECT_STREQ(refused.error().rule, "FD6");
  }
  for (const float a : {0.4999f, -0.4999f}) {
    l.numbers = {1, a};
    EXPECT_TRUE(field_torus(l.band(), 0, 0, kSide, torus.data())) << a;
  }
}

TEST(FieldTorus, RepeatsAtEveryLevel) {
  FieldRecipe recipe;
  recipe.model = ModelId::gmrf;
  const LoadedField f = loaded(file_of(make_field(recipe)));
  const std::uint32_t subspaces[] = {0};
  const auto values = [&](std::uint32_t level, std::int64_t x, std::int64_t y) {
    return field_collapse(f.item, f.p, level, 0, subspaces, {x, y, 33, 21});
  };
  for (std::uint32_t level = 0; level < 3; ++level) {
    const std::int64_t side = 64 >> level;
    EXPECT_EQ(values(level, 5, -3), values(level, 5 - side, -3 + 2 * side)) << level;
    EXPECT_EQ(values(level, 5, -3), values(level, 5 + (kTurn >> level), -3 - (kTurn >> level))) << level;
    EXPECT_NE(values(level, 5, -3), values(level, 5 + side / 2, -3)) << level;
  }
}

// ---- The pyramid's collapse (section 5.4) ----

TEST(FieldCollapse, ExpandingByItsDefinition) {
  SplitMix64 random(21);
  for (int i = 0; i < 200; ++i) {
    const FieldWindow fine{std::int64_t{random.below(40)} - 20, std::int64_t{random.below(40)} - 20,
                           1 + random.below(30), 1 + random.below(30)};
    const FieldWindow coarse = field_coarse_window(fine);
    std::vector<float> from(coarse.texels()), to(fine.texels(), 10.0f);
    for (float& v : from) v = static_cast<float>(random.uniform());
    field_expand_add(from.data(), coarse, fine, to.data());
    const auto weight = [](std::int64_t at, std::int64_t c) -> double {
      const std::int64_t half = at >> 1;
      if ((at & 1) != 0) return c == half || c == half + 1 ? 0.5 : 0;
      return c == half ? 0.75 : c == half - 1 || c == half + 1 ? 0.125 : 0;
    };
    for (std::size_t t = 0; t < fine.texels(); ++t) {
      const std::int64_t x = fine.x + static_cast<std::int64_t>(t % fine.width),
                         y = fine.y + static_cast<std::int64_t>(t / fine.width);
      double sum = 10;
      for (std::size_t c = 0; c < coarse.texels(); ++c) {
        sum += double{from[c]} * weight(x, coarse.x + static_cast<std::int64_t>(c % coarse.width)) *
               weight(y, coarse.y + static_cast<std::int64_t>(c / coarse.width));
      }
      ASSERT_NEAR(to[t], sum, 3e-6) << i;
    }
  }
}

// Any window is part of any other, up to what margins leave out; of tori exactly.
TEST(FieldCollapse, WindowsAgree) {
  for (const ModelId model : {ModelId::car, ModelId::gmrf, ModelId::car3d}) {
    FieldRecipe recipe;
    recipe.model = model;
    recipe.clusters = 2;
    recipe.rings = 1;
    recipe.channels = {2};
    const MadeField made = make_field(recipe);
    const LoadedField f = loaded(file_of(made));
    const std::uint32_t subspaces[] = {1, 0};
    for (const std::int64_t origin : {std::int64_t{-40}, (kTurn >> 1) - 40, -kTurn - 40}) {
      const FieldWindow big{origin, origin, 90, 80};
      const std::vector<float> all = field_collapse(f.item, f.p, 0, 0, subspaces, big);
      SplitMix64 random(4);
      for (int i = 0; i < 30; ++i) {
        FieldWindow part{0, 0, 1 + random.below(40), 1 + random.below(40)};
        const std::uint32_t x = random.below(50), y = random.below(40);
        part.x = origin + x;
        part.y = origin + y;
        const std::vector<float> own = field_collapse(f.item, f.p, 0, 0, subspaces, part);
        double worst = 0;
        for (std::size_t plane = 0; plane < 4; ++plane) {
          for (std::size_t t = 0; t < part.texels(); ++t) {
            const float there =
                all[plane * big.texels() + (y + t / part.width) * big.width + x + t % part.width];
            worst = std::max(worst, std::fabs(double{own[plane * part.texels() + t]} - double{there}));
          }
        }
        ASSERT_LE(worst, model == ModelId::gmrf ? 0.0 : double{made.shape.error}) << origin;
      }
    }
  }
}

// Seams between windows shrink as margins grow.
TEST(FieldCollapse, SeamsByMargin) {
  FieldRecipe recipe;
  recipe.whole = 0.7;
  recipe.order = 4;
  recipe.channels = {1};
  recipe.spread = 1;
  double before = 1e9;
  for (const std::uint32_t margin : {8u, 16u, 32u, 64u}) {
    recipe.margin = margin;
    const LoadedField f = loaded(file_of(make_field(recipe)));
    const std::uint32_t subspaces[] = {0};
    const FieldWindow big{0, 0, 64, 64};
    const std::vector<float> all = field_collapse(f.item, f.p, 0, 0, subspaces, big);
    double worst = 0;
    SplitMix64 random(2);
    for (int i = 0; i < 40; ++i) {
      const std::uint32_t x = random.below(60), y = random.below(60);
      const std::vector<float> own = field_collapse(f.item, f.p, 0, 0, subspaces, {x, y, 4, 4});
      for (std::uint32_t t = 0; t < 16; ++t)
        worst = std::max(worst, std::fabs(double{own[t]} - double{all[(y + t / 4) * 64 + x + t % 4]}));
    }
    EXPECT_LT(worst, 0.5 * before) << margin;
    if (margin == 8) {
      EXPECT_GT(worst, 1e-4);
    }
    if (margin == 64) {
      EXPECT_LT(worst, 1e-5);
    }
    before = worst;
  }
}

}  // namespace
}  // namespace btfc::test
