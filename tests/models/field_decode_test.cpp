// Random fields through the decoder: single texels against tiles, places far out, periods, levels, blending
// of subspaces, and the bump filter.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "encoder/models/field_records.h"
#include "format/models/field_collapse.h"
#include "tests/btf_support.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::uint32_t kShare = 8;  // of the counts: everything is slower
#else
constexpr std::uint32_t kShare = 1;
#endif

constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                       kHigh = std::numeric_limits<std::int32_t>::max();
constexpr ModelId kModels[] = {ModelId::car, ModelId::gmrf, ModelId::car3d};

btfc_selection part(std::uint32_t levels, std::uint32_t period, std::uint32_t relief) {
  return {sizeof(btfc_selection), levels, period, relief, 0, 0};
}

ScratchPtr scratch_of(const TexturePtr& texture) { return ScratchPtr(btfc_scratch_new(texture.get())); }

btfc_query query_at(std::int32_t x, std::int32_t y, std::uint32_t level = 0, float footprint = 1) {
  btfc_query q{};
  q.x = x;
  q.y = y;
  q.level = level;
  q.footprint = footprint;
  q.view[2] = q.light[2] = 1;
  return q;
}

void set_direction(float (&to)[3], SplitMix64& random) {
  to[0] = static_cast<float>(2 * random.uniform() - 1);
  to[1] = static_cast<float>(2 * random.uniform() - 1);
  to[2] = static_cast<float>(random.uniform());
}

// Anywhere, any level and footprint, under any directions.
std::vector<btfc_query> random_queries(SplitMix64& random, std::size_t count, std::uint32_t maps,
                                       std::uint32_t reach, bool far) {
  std::vector<btfc_query> queries(count);
  constexpr float kFootprints[] = {0, 1, 1.9f, 2, 4.5f, 100, 1e30f};
  // Few directions, so that queries that lie together often share one of them or both.
  float directions[3][3];
  for (auto& d : directions) set_direction(d, random);
  for (btfc_query& q : queries) {
    const auto place = [&] {
      const auto near = static_cast<std::int32_t>(random.below(2 * reach)) - static_cast<std::int32_t>(reach);
      if (!far || random.below(2) == 0) return near;
      return near >= 0 ? kHigh - near : kLow - near;
    };
    q = query_at(place(), place(), random.below(6), kFootprints[random.below(7)]);
    q.map = random.below(maps);
    std::copy_n(directions[random.below(3)], 3, q.view);
    std::copy_n(directions[random.below(3)], 3, q.light);
  }
  return queries;
}

// One query a call, no scratch: the direct form.
std::vector<float> one_by_one(const TexturePtr& texture, std::span<const btfc_query> queries) {
  std::vector<float> values;
  for (const btfc_query& q : queries) {
    const std::vector<float> own = answers(texture.get(), nullptr, {&q, 1});
    values.insert(values.end(), own.begin(), own.end());
  }
  return values;
}

FieldRecipe rich(ModelId model) {
  FieldRecipe recipe = rich_recipe(model);
  recipe.range_width = 8;
  recipe.range_height = 6;
  return recipe;
}

// A range map of waves.
MadeField rich_field(ModelId model) {
  MadeField made = make_field(rich(model));
  made.payload.relief = 0.75f;
  made.payload.height_step = 0.01f;
  for (std::size_t i = 0; i < made.payload.range.size(); ++i)
    made.payload.range[i] = static_cast<std::uint16_t>(i * 7919 % 500);
  return made;
}

// How much the error of factors may grow on its way to values: the gain is at most 2, a channel adds up d
// factors (in the stated error already), the bump filter up to 2.
double allowed(const MadeField& made) { return 2 * 2 * double{made.shape.error}; }

TEST(FieldDecode, DirectFormIsTheTiles) {
  for (const ModelId model : kModels) {
    const MadeField made = rich_field(model);
    const Bytes file = file_of(made);
    struct Case {
      std::uint32_t relief, period;  // a multiple of the tile, of the torus and of 2^(P - 1)
    };
    for (const auto& [relief, period] :
         {Case{0, 0}, Case{0, 192}, Case{BTFC_RELIEF_NONE, 0}, Case{BTFC_RELIEF_SHADOW, 0},
          Case{BTFC_RELIEF_PARALLAX, 192}, Case{BTFC_RELIEF_SHADOW | BTFC_RELIEF_PARALLAX, 0}}) {
      const TexturePtr texture = load_part(file, part(0, period, relief));
      ASSERT_TRUE(texture);
      SplitMix64 random(relief * 10 + period);
      const std::vector<btfc_query> queries = random_queries(random, 24 / std::min(kShare, 4u), 2, 300, true);
      const ScratchPtr scratch = scratch_of(texture);
      EXPECT_LE(
          worst_difference(one_by_one(texture, queries), answers(texture.get(), scratch.get(), queries)),
          allowed(made))
          << name_of(made.head.maps[0].type) << " " << relief << " " << period;
    }
  }
}

// However many queries a call has, and in whatever order, a scratch gives the same bits.
TEST(FieldDecode, CallsOfAnySizeAgree) {
  for (const ModelId model : kModels) {
    const MadeField made = rich_field(model);
    const TexturePtr texture = load(file_of(made));
    ASSERT_TRUE(texture);
    SplitMix64 random(9);
    std::vector<btfc_query> queries = random_queries(random, 10000 / kShare, 2, 60, false);
    for (btfc_query& q : queries) {
      q.level = q.level % 2;
      q.footprint = q.footprint < 2 ? 1 : 2;
    }
    const ScratchPtr scratch = scratch_of(texture);
    const std::vector<float> all = answers(texture.get(), scratch.get(), queries);
    EXPECT_EQ(all, answers(texture.get(), nullptr, queries)) << "many queries without a scratch";
    for (const std::size_t count : {std::size_t{1}, std::size_t{255}, std::size_t{256}, std::size_t{1000}}) {
      const std::span<const btfc_query> some(queries.data(), count);
      const std::vector<float> expected(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(4 * count));
      EXPECT_EQ(expected, answers(texture.get(), scratch.get(), some)) << count;
      const ScratchPtr fresh = scratch_of(texture);
      EXPECT_EQ(expected, answers(texture.get(), fresh.get(), some)) << count;
    }
    std::vector<float> backwards;
    std::reverse(queries.begin(), queries.end());
    const ScratchPtr other = scratch_of(texture);
    for (std::size_t q = 0; q < 1000 / kShare; ++q) {
      const std::vector<float> own =
          answers(texture.get(), other.get(), {&queries[queries.size() - 1 - q], 1});
      backwards.insert(backwards.end(), own.begin(), own.end());
    }
    EXPECT_EQ(backwards,
              std::vector<float>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(backwards.size())));
  }
}

TEST(FieldDecode, RectanglesAreQueries) {
  for (const ModelId model : kModels) {
    const TexturePtr texture = load(file_of(rich_field(model)));
    ASSERT_TRUE(texture);
    const ScratchPtr scratch = scratch_of(texture);
    struct Place {
      std::int32_t x, y;
      std::uint32_t level;
    };
    for (const Place& at :
         {Place{-20, 250, 0}, Place{kHigh - 40, kLow, 0}, Place{500, -7, 1}, Place{kHigh - 60, 3, 2}}) {
      const btfc_directions look{{0.3f, -0.2f, 0.8f}, {-0.5f, 0.1f, 0.6f}, 3, at.level};
      constexpr std::uint32_t kWidth = 41, kHeight = 23;
      for (std::uint32_t map = 0; map < 2; ++map) {
        const std::vector<float> rect =
            rectangle(texture.get(), scratch.get(), look, at.x, at.y, kWidth, kHeight, map);
        const std::size_t channels = map == 0 ? 3 : 1;
        std::vector<btfc_query> queries;
        for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) {
          // Coordinates wrap as unsigned numbers do.
          btfc_query q =
              query_at(static_cast<std::int32_t>(static_cast<std::uint32_t>(at.x) + i % kWidth),
                       static_cast<std::int32_t>(static_cast<std::uint32_t>(at.y) + i / kWidth), at.level, 3);
          q.map = map;
          std::copy_n(look.view, 3, q.view);
          std::copy_n(look.light, 3, q.light);
          queries.push_back(q);
        }
        const std::vector<float> values = answers(texture.get(), scratch.get(), queries);
        std::vector<float> same(rect.size());
        for (std::size_t i = 0; i < rect.size(); ++i) same[i] = values[i / channels * 4 + i % channels];
        EXPECT_EQ(rect, same) << at.x << " " << at.level;
      }
    }
  }
}

// A plain file: one subspace, no tables, no relief; d = 1, so that a value is mean + factor.
MadeField plain_field(ModelId model) {
  FieldRecipe recipe;
  recipe.model = model;
  recipe.channels = {1};
  MadeField made = make_field(recipe);
  if (model != ModelId::car3d) made.payload.records[made.basis_at(0)] = 1;
  return made;
}

TEST(FieldDecode, TexelsAreOneBigWindow) {
  for (const ModelId model : kModels) {
    const MadeField made = plain_field(model);
    const Bytes file = file_of(made);
    const LoadedField f = loaded(file);
    const TexturePtr texture = load(file);
    const ScratchPtr scratch = scratch_of(texture);
    constexpr std::uint32_t kSide = 48;
    const std::uint32_t subspaces[] = {0};
    for (std::uint32_t level = 0; level < 3; ++level) {
      // Across 2^31, where the coordinates turn from the highest to the lowest number, and across 2^32.
      for (const std::int64_t origin : {(std::int64_t{1} << 31) - 24, -std::int64_t{24}}) {
        const std::vector<float> window =
            field_collapse(f.item, f.p, level, level, subspaces, {origin, origin, kSide, kSide});
        std::vector<btfc_query> queries;
        std::vector<float> expected;
        SplitMix64 random(level);
        for (std::uint32_t i = 0; i < 200; ++i) {
          const std::uint32_t x = random.below(kSide), y = random.below(kSide);
          queries.push_back(query_at(static_cast<std::int32_t>(static_cast<std::uint32_t>(origin + x)),
                                     static_cast<std::int32_t>(static_cast<std::uint32_t>(origin + y)),
                                     level));
          expected.insert(expected.end(), {made.payload.records[0] + window[y * kSide + x], 0, 0, 0});
        }
        EXPECT_LE(worst_difference(expected, answers(texture.get(), scratch.get(), queries)),
                  double{made.shape.error})
            << level << " " << origin;
        EXPECT_LE(worst_difference(expected, one_by_one(texture, queries)), double{made.shape.error})
            << level << " " << origin;
      }
    }
  }
}

TEST(FieldDecode, Periods) {
  for (const ModelId model : kModels) {
    FieldRecipe recipe;
    recipe.model = model;
    recipe.torus_log2 = 3;
    const MadeField made = make_field(recipe);
    const Bytes file = file_of(made);
    const bool torus = model == ModelId::gmrf;
    // As short as they may be, shorter than the margins, and beyond a tile.
    for (const std::uint32_t period : {torus ? 8u : 4u, 40u, 264u, 1u << 30}) {
      const TexturePtr texture = load_part(file, part(0, period, 0));
      ASSERT_TRUE(texture) << period;
      const ScratchPtr scratch = scratch_of(texture);
      const auto n = static_cast<std::int64_t>(period);
      SplitMix64 random(period);
      std::vector<btfc_query> here, there;
      for (int i = 0; i < 60; ++i) {
        const std::uint32_t level = random.below(3);
        const std::int64_t x = random.below(700) - std::int64_t{350},
                           y = random.below(700) - std::int64_t{350};
        here.push_back(query_at(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), level));
        there.push_back(query_at(static_cast<std::int32_t>(x + (n >> level)),
                                 static_cast<std::int32_t>(y - (n >> level)), level));
      }
      const std::vector<float> values = answers(texture.get(), scratch.get(), here);
      EXPECT_EQ(values, answers(texture.get(), scratch.get(), there)) << period;
      EXPECT_LE(worst_difference(values, one_by_one(texture, here)), double{made.shape.error}) << period;
      EXPECT_LE(worst_difference(values, one_by_one(texture, there)), double{made.shape.error}) << period;
      if (period < 1000) {
        for (btfc_query& q : there) q.x += static_cast<std::int32_t>(n / 2);
        EXPECT_NE(values, answers(texture.get(), scratch.get(), there)) << "repeats too soon";
      }
    }
    btfc_error error{};
    for (const std::uint32_t period :
         {1u, 2u, 3u, 5u, torus ? 12u : 6u, 4097u, 1u << 31, 3u << 30, 0xfffffff8u}) {
      EXPECT_FALSE(load_part(file, part(0, period, 0), &error)) << period;
      EXPECT_EQ(error.result, BTFC_BAD_ARGUMENT);
    }
  }
}

// With a relief the tile of 32 x 24 has to fit in too; without the filter it has not.
TEST(FieldDecode, PeriodsOfReliefs) {
  const Bytes file = file_of(rich_field(ModelId::car));
  EXPECT_FALSE(load_part(file, part(0, 32, 0)));
  EXPECT_TRUE(load_part(file, part(0, 32, BTFC_RELIEF_NONE)));
  const TexturePtr texture = load_part(file, part(0, 96, 0));
  ASSERT_TRUE(texture);
  const ScratchPtr scratch = scratch_of(texture);
  const btfc_directions look{{0, 0, 1}, {0.6f, 0.2f, 0.7f}, 1, 0};
  EXPECT_EQ(rectangle(texture.get(), scratch.get(), look, -50, 3, 40, 30),
            rectangle(texture.get(), scratch.get(), look, 46, 99, 40, 30));
}

// ---- Levels ----

struct CountedFile {
  const Bytes* bytes;
  std::vector<std::uint64_t> reads;
};

// A level that was not loaded is not read, and what coarser ones say stands.
TEST(FieldDecode, CoarseLevelsNeedNoFinerOnes) {
  for (const ModelId model : kModels) {
    FieldRecipe recipe = rich(model);
    recipe.levels = 4;
    recipe.range_width = recipe.range_height = 0;
    const MadeField made = make_field(recipe);
    const Bytes file = file_of(made);
    const TexturePtr whole = load(file);
    const ScratchPtr whole_scratch = scratch_of(whole);
    for (std::uint32_t levels = 1; levels <= 4; ++levels) {
      CountedFile counted{&file, {}};
      btfc_source source{};
      source.user = &counted;
      source.size = file.size();
      source.read = [](void* user, std::uint64_t offset, void* destination, std::size_t size) {
        auto* from = static_cast<CountedFile*>(user);
        from->reads.push_back(offset);
        std::memcpy(destination, from->bytes->data() + offset, size);
        return 0;
      };
      btfc_reader* reader = nullptr;
      ASSERT_EQ(btfc_reader_open(&source, nullptr, &reader, nullptr), BTFC_OK);
      const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
      const btfc_selection selection = part(levels, 0, 0);
      btfc_texture* loaded_part = nullptr;
      ASSERT_EQ(btfc_texture_load(reader, &selection, &loaded_part, nullptr), BTFC_OK);
      const TexturePtr texture(loaded_part);
      btfc_file_info info{};
      btfc_reader_info(reader, &info);
      std::uint32_t read_levels = 0;
      for (std::uint32_t c = 0; c < info.chunks; ++c) {
        btfc_chunk_info chunk{};
        btfc_reader_chunk_info(reader, c, &chunk);
        if (std::string(chunk.type) != "FLDS") continue;
        const bool read =
            std::find(counted.reads.begin(), counted.reads.end(), chunk.offset) != counted.reads.end();
        EXPECT_EQ(read, chunk.level < levels);
        read_levels += read ? 1 : 0;
      }
      EXPECT_EQ(read_levels, levels);

      const std::uint32_t least = 4 - levels;
      const ScratchPtr scratch = scratch_of(texture);
      SplitMix64 random(levels);
      std::vector<btfc_query> queries = random_queries(random, 16, 2, 60, false);
      for (std::uint32_t level = 0; level < 4; ++level) {
        for (btfc_query& q : queries) {
          q.level = level;
          q.footprint = 1;
        }
        const std::vector<float> coarse = answers(texture.get(), scratch.get(), queries);
        EXPECT_LE(worst_difference(coarse, one_by_one(texture, queries)), allowed(made));
        // The full texture, asked for what is no finer.
        for (btfc_query& q : queries) q.footprint = static_cast<float>(1u << least);
        EXPECT_EQ(coarse, answers(whole.get(), whole_scratch.get(), queries)) << levels << " " << level;
      }
    }
  }
}

// The even texels of a level are a coarser level's texels, expanded: footprints change what counts, not
// where.
TEST(FieldDecode, FootprintsAreLevels) {
  const MadeField made = plain_field(ModelId::car);
  const TexturePtr texture = load(file_of(made));
  const ScratchPtr scratch = scratch_of(texture);
  const btfc_directions wide{{0, 0, 1}, {0, 0, 1}, 2, 0}, coarse{{0, 0, 1}, {0, 0, 1}, 1, 1};
  const std::vector<float> fine = rectangle(texture.get(), scratch.get(), wide, -20, 6, 40, 40);
  const std::vector<float> half = rectangle(texture.get(), scratch.get(), coarse, -12, 0, 30, 30);
  const auto coarse_at = [&](int x, int y) { return half[static_cast<std::size_t>(y * 30 + x + 12)]; };
  const auto along = [&](int x, int y) {
    const int i = x >> 1;
    return x % 2 == 0 ? 0.125f * coarse_at(i - 1, y) + 0.75f * coarse_at(i, y) + 0.125f * coarse_at(i + 1, y)
                      : 0.5f * coarse_at(i, y) + 0.5f * coarse_at(i + 1, y);
  };
  for (int y = 6; y < 46; ++y) {
    for (int x = -20; x < 20; ++x) {
      const int j = y >> 1;
      const float expected = y % 2 == 0
                                 ? 0.125f * along(x, j - 1) + 0.75f * along(x, j) + 0.125f * along(x, j + 1)
                                 : 0.5f * along(x, j) + 0.5f * along(x, j + 1);
      ASSERT_NEAR(fine[static_cast<std::size_t>((y - 6) * 40 + x + 20)], expected, 2e-6f) << x << " " << y;
    }
  }
}

// A table that bends: values' means stay from level to level because of the rests.
TEST(FieldDecode, MeansStayFromLevelToLevel) {
  FieldRecipe recipe;
  recipe.channels = {1};
  recipe.knots = 33;
  recipe.levels = 4;
  recipe.whole = 0.4;
  recipe.margin = 16;
  MadeField made = make_field(recipe);
  made.payload.records[made.basis_at(0)] = 1;
  for (std::uint32_t i = 0; i < 33; ++i)
    made.payload.records[made.factor_at(0, 0) + 4 + i] =
        0.1f * std::exp(0.7f * (6 * static_cast<float>(i) / 32 - 3));
  // Each level has half of what is finer than it.
  for (std::vector<float>& level : made.payload.levels) level[0] = 0.1f;
  const LoadedField f = loaded(file_of(made));
  const std::vector<double> variance = factor_variances(f.item, f.p, 0, 0);
  const auto set = [&](bool rests) {
    float* to = &made.payload.records[made.factor_at(0, 0)];
    to[0] = static_cast<float>(1 / std::sqrt(variance[0]));
    for (std::size_t l = 1; l < 4; ++l)
      to[l] = rests ? static_cast<float>(std::sqrt(1 - variance[l] / variance[0])) : 0;
  };
  const auto mean_at = [&](std::uint32_t level) {
    const TexturePtr texture = load(file_of(made));
    const btfc_directions look{{0, 0, 1}, {0, 0, 1}, 1, level};
    return mean_of(rectangle(texture.get(), nullptr, look, 0, 0, 512u >> level, 512u >> level));
  };
  set(true);
  const double fine = mean_at(0);
  EXPECT_NEAR(mean_at(1), fine, 0.001);
  EXPECT_NEAR(mean_at(2), fine, 0.001);
  EXPECT_NEAR(mean_at(3), fine, 0.002);
  const btfc_directions wide{{0, 0, 1}, {0, 0, 1}, 4, 0};
  EXPECT_NEAR(mean_of(rectangle(load(file_of(made)).get(), nullptr, wide, 0, 0, 512, 512)), fine, 0.02)
      << "rests do not know what expanding smooths";
  set(false);
  EXPECT_LT(mean_at(2), fine - 0.005) << "without rests means sink, or this test says nothing";
}

// The stated variances are those of the values.
TEST(FieldDecode, VariancesAreTheFields) {
  for (const ModelId model : kModels) {
    FieldRecipe recipe;
    recipe.model = model;
    recipe.channels = {2};
    recipe.whole = 0.45;
    recipe.margin = 20;
    const LoadedField f = loaded(file_of(make_field(recipe)));
    const std::uint32_t subspaces[] = {0};
    for (std::uint32_t factor = 0; factor < 2; ++factor) {
      const std::vector<double> stated = factor_variances(f.item, f.p, 0, factor);
      for (std::uint32_t level = 0; level < 3; ++level) {
        const FieldWindow window{0, 0, 512, 512};
        const std::vector<float> values = field_collapse(f.item, f.p, level, level, subspaces, window);
        const std::span<const float> own(values.data() + factor * window.texels(), window.texels());
        const double mean = mean_of(own);
        double variance = 0;
        for (const float v : own) variance += (v - mean) * (v - mean);
        EXPECT_NEAR(variance / static_cast<double>(window.texels()) / stated[level], 1, 0.05) << level;
      }
    }
  }
}

// ---- Blending of subspaces ----

TEST(FieldBlending, WeightsAndGains) {
  MadeField made = rich_field(ModelId::car);
  // Two subspaces that agree, two that differ in sign, one without anything.
  const std::array<std::array<float, 4>, 5> signatures = {
      {{1, 0, 0, 0.1f}, {1, 0, 0, 0.1f}, {0, 1, 0, 0}, {0, -1, 0, 0}, {0, 0, 0, 0}}};
  for (std::size_t k = 0; k < 5; ++k)
    std::copy(signatures[k].begin(), signatures[k].end(), &made.payload.records[made.signature_at(k)]);
  const LoadedField f = loaded(file_of(made));
  SplitMix64 random(31);
  bool grown = false, capped = false, several = false;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    float view[3], light[3];
    set_direction(view, random);
    set_direction(light, random);
    const FieldBlend b =
        field_blend(f.words(), f.p, vec3(view[0], view[1], view[2]), vec3(light[0], light[1], light[2]));
    double sum = 0;
    int count = 0;
    std::vector<double> s = {0, 0, 0};
    double wanted = 0, own = 0;
    for (int k = 0; k < 4; ++k) {
      const double w = double{b.weight[k]};
      ASSERT_GE(w, 0);
      if (w == 0) continue;
      ASSERT_LT(b.subspace[k], 5u);
      for (int j = 0; j < k; ++j)
        ASSERT_FALSE(b.weight[j] > 0 && b.subspace[j] == b.subspace[k]) << "counted twice";
      ++count;
      sum += w;
      const auto& signature = signatures[b.subspace[k]];
      for (std::size_t n = 0; n < 3; ++n) {
        s[n] += w * double{signature[n]};
        wanted += w * double{signature[n]} * double{signature[n]};
      }
      wanted += w * double{signature[3]} * double{signature[3]};
      own += w * w * double{signature[3]} * double{signature[3]};
    }
    ASSERT_NEAR(sum, 1, 1e-5);
    const double have = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + own;
    const double expected = have > 1e-12 ? std::clamp(std::sqrt(wanted / have), 1.0, 2.0)
                            : have > 0   ? 2.0
                                         : 1.0;
    if (have == 0 || have > 1e-9) {
      ASSERT_NEAR(double{b.gain}, expected, 1e-3);
    }
    ASSERT_GE(b.gain, 1.0f);
    ASSERT_LE(b.gain, 2.0f);
    if (count == 1) {
      ASSERT_NEAR(b.gain, 1.0f, 1e-6f);
    }
    several = several || count == 4;
    grown = grown || (b.gain > 1.1f && b.gain < 1.9f);
    capped = capped || b.gain == 2.0f;
  }
  EXPECT_TRUE(grown && capped && several);
}

TEST(FieldBlending, MeasuredPairsAreTheirSubspacesAlone) {
  const MadeField made = rich_field(ModelId::gmrf);
  const Bytes file = file_of(made);
  const LoadedField f = loaded(file);
  const TexturePtr texture = load(file);
  for (std::uint32_t pair = 0; pair < btfc_texture_pairs(texture.get()); ++pair) {
    std::uint32_t view = 0, light = 0;
    float v[3], l[3];
    btfc_texture_pair(texture.get(), pair, &view, &light);
    btfc_texture_view(texture.get(), view, v);
    btfc_texture_light(texture.get(), light, l);
    const FieldBlend b = field_blend(f.words(), f.p, vec3(v[0], v[1], v[2]), vec3(l[0], l[1], l[2]));
    for (int k = 0; k < 4; ++k) {
      if (b.weight[k] > 0) {
        ASSERT_EQ(b.subspace[k], made.payload.subspace_of_pair[pair]);
      }
    }
    ASSERT_NEAR(b.gain, 1.0f, 1e-6f);
  }
}

// Along a path of directions values change the less, the finer its steps are: nothing jumps.
TEST(FieldBlending, ValuesAreContinuousInDirections) {
  MadeField made = rich_field(ModelId::gmrf);
  made.payload.relief = 0;
  const TexturePtr texture = load(file_of(made));
  const ScratchPtr scratch = scratch_of(texture);
  const auto largest_step = [&](std::uint32_t steps) {
    std::vector<btfc_query> queries;
    for (std::uint32_t i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps, a = 7 * t, b = 2 - 5 * t;
      btfc_query q = query_at(17, 23);
      q.view[0] = static_cast<float>(0.55 * t * std::cos(a));
      q.view[1] = static_cast<float>(0.55 * t * std::sin(a));
      q.light[0] = static_cast<float>(0.5 * (1 - t) * std::cos(b));
      q.light[1] = static_cast<float>(0.5 * (1 - t) * std::sin(b));
      queries.push_back(q);
    }
    const std::vector<float> values = answers(texture.get(), scratch.get(), queries);
    double worst = 0;
    for (std::size_t i = 4; i < values.size(); ++i)
      worst = std::max(worst, std::fabs(double{values[i]} - double{values[i - 4]}));
    return worst;
  };
  const double coarse = largest_step(2000), fine = largest_step(32000);
  EXPECT_GT(coarse, 1e-4) << "the path goes nowhere";
  EXPECT_LT(fine, coarse / 8);
}

// ---- The bump filter ----

// A car file whose colours are its means, of a range map given by a formula (texels of the map -> texels of
// height).
template <class Height>
MadeField relief_field(const Height& height) {
  FieldRecipe recipe;
  recipe.channels = {1};
  recipe.width = recipe.height = 32;
  recipe.range_width = recipe.range_height = 16;
  MadeField made = make_field(recipe);
  for (std::vector<float>& level : made.payload.levels) level[0] = 0;
  made.payload.records[0] = 0.5f;
  made.payload.relief = 1;
  made.payload.height_step = 0.001f;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x)
      made.payload.range[static_cast<std::size_t>(y * 16 + x)] =
          static_cast<std::uint16_t>(std::lround(1000 * height(x, y)));
  }
  return made;
}

std::vector<float> shaded(const MadeField& made, float x, float y, float z, std::uint32_t options = 0) {
  const TexturePtr texture = load_part(file_of(made), part(0, 0, options));
  const btfc_directions look{{0.5f, 0, 0.8f}, {x, y, z}, 1, 0};
  return rectangle(texture.get(), nullptr, look, 0, 0, 32, 32);
}

TEST(FieldRelief, LevelGroundIsLeftAlone) {
  const MadeField made = relief_field([](int, int) { return 5.0; });
  for (const std::uint32_t options : {0u, BTFC_RELIEF_SHADOW, BTFC_RELIEF_PARALLAX, BTFC_RELIEF_NONE}) {
    for (const float v : shaded(made, 0.4f, -0.7f, 0.6f, options)) ASSERT_NEAR(v, 0.5f, 1e-6f);
  }
}

// A ridge of two slopes, rising towards +x in the left half, falling in the right; and the same downwards,
// where the upper half rises towards the image's bottom and so faces its top.
TEST(FieldRelief, SlopesThatFaceTheLightAreBright) {
  const auto ridge = [](int i) { return 0.4 * (i < 8 ? i : 16 - i); };
  const MadeField across = relief_field([&](int x, int) { return ridge(x); });
  const MadeField down = relief_field([&](int, int y) { return ridge(y); });
  const auto at = [](const std::vector<float>& v, int x, int y) {
    return double{v[static_cast<std::size_t>(y * 32 + x)]};
  };
  // A height of 0.4 each 2 texels: a slope of 1/5. Its cosine by that of level ground, of light (+-0.6, 0,
  // 0.8).
  const double facing = (0.8 + 0.2 * 0.6) / std::sqrt(1.04) / 0.8,
               averted = (0.8 - 0.2 * 0.6) / std::sqrt(1.04) / 0.8;
  const std::vector<float> right = shaded(across, 0.6f, 0, 0.8f), left = shaded(across, -0.6f, 0, 0.8f);
  const std::vector<float> top = shaded(down, 0, 0.6f, 0.8f), bottom = shaded(down, 0, -0.6f, 0.8f);
  for (int i = 4; i < 30; i += 5) {
    EXPECT_NEAR(at(right, 8, i), 0.5 * averted, 1e-3);
    EXPECT_NEAR(at(right, 24, i), 0.5 * facing, 1e-3);
    EXPECT_NEAR(at(left, 8, i), 0.5 * facing, 1e-3);
    EXPECT_NEAR(at(left, 24, i), 0.5 * averted, 1e-3);
    EXPECT_NEAR(at(top, i, 8), 0.5 * facing, 1e-3);
    EXPECT_NEAR(at(top, i, 24), 0.5 * averted, 1e-3);
    EXPECT_NEAR(at(bottom, i, 8), 0.5 * averted, 1e-3);
    EXPECT_NEAR(at(bottom, i, 24), 0.5 * facing, 1e-3);
  }
  // Half the strength, half the difference.
  MadeField weak = across;
  weak.payload.relief = 0.5f;
  EXPECT_NEAR(at(shaded(weak, 0.6f, 0, 0.8f), 24, 9), 0.5 * (1 + 0.5 * (facing - 1)), 1e-3);
  for (const float v : shaded(across, 0.6f, 0, 0.8f, BTFC_RELIEF_NONE)) ASSERT_EQ(v, 0.5f);
}

TEST(FieldRelief, ShadowsLieBehindWalls) {
  // A wall 6 texels high over columns 12 to 15 of the map, texels 24 to 31.
  const MadeField made = relief_field([](int x, int) { return x >= 12 ? 6.0 : 0.0; });
  const std::vector<float> lit = shaded(made, 0.7f, 0, 0.7f),
                           shadow = shaded(made, 0.7f, 0, 0.7f, BTFC_RELIEF_SHADOW);
  // Light from +x at 45 degrees: the 5 texels before the wall lie in its shadow, those 9 and more off do not.
  EXPECT_EQ(shadow[16 * 32 + 20], 0.0f);
  EXPECT_EQ(shadow[16 * 32 + 10], lit[16 * 32 + 10]);
  EXPECT_GT(lit[16 * 32 + 20], 0.3f);
  // Out of the shadow nothing changes.
  for (std::size_t i = 0; i < lit.size(); ++i) ASSERT_TRUE(shadow[i] == lit[i] || shadow[i] == 0.0f);
  EXPECT_EQ(shaded(made, 0, 0, 1, BTFC_RELIEF_SHADOW), shaded(made, 0, 0, 1));
}

TEST(FieldRelief, ParallaxMovesTexelsAlongTheView) {
  MadeField made = relief_field([](int, int) { return 3.0; });
  made.payload.relief = 0;
  made.payload.levels[0][0] = 0.1f;
  const Bytes file = file_of(made);
  const TexturePtr still = load(file), moved = load_part(file, part(0, 0, BTFC_RELIEF_PARALLAX));
  // A height of 3 seen under tan 1: what stands at (x, y) is what lies 3 texels against the view, y being up.
  const btfc_directions right{{0.5f, 0, 0.5f}, {0, 0, 1}, 1, 0}, up{{0, 0.5f, 0.5f}, {0, 0, 1}, 1, 0};
  EXPECT_EQ(rectangle(moved.get(), nullptr, right, 10, 10, 20, 20),
            rectangle(still.get(), nullptr, right, 7, 10, 20, 20));
  EXPECT_EQ(rectangle(moved.get(), nullptr, up, 10, 10, 20, 20),
            rectangle(still.get(), nullptr, up, 10, 13, 20, 20));
  // Across the ends of the coordinates.
  EXPECT_EQ(rectangle(moved.get(), nullptr, right, kLow, kLow, 9, 9)[3],
            rectangle(still.get(), nullptr, right, kLow, kLow, 9, 9)[0]);
}

}  // namespace
}  // namespace btfc::test
