// The prepared atlas of random fields: what the CPU makes, what the passes make when their shaders' own
// header runs here, and what a texel is that is read from it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "decoder/field_plan.h"
#include "decoder/field_values.h"
#include "shaders/models/field_prepare.h"
#include "tests/btf_support.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                       kHigh = std::numeric_limits<std::int32_t>::max();
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr ModelId kModels[] = {ModelId::car, ModelId::gmrf, ModelId::car3d};

FieldRecipe rich(ModelId model) {
  FieldRecipe recipe = rich_recipe(model);
  recipe.torus_log2 = 4;
  return recipe;
}

// As field_decode_test.cpp: the gain is at most 2, and so is the bump filter, which is not used here.
double allowed(const MadeField& made) { return 2 * double{made.shape.error}; }

struct Prepared {
  LoadedItem item;  // with its plan's parameters; slot 2 is empty
  GpuPrepare plan;
  FieldParams p;  // of map 0
};

Prepared prepared(LoadedItem item, const GpuWindow& window, std::uint32_t period = 0) {
  Prepared out;
  out.item = std::move(item);
  EXPECT_TRUE(field_select(out.item, {period, 0, 0, 0}));
  Result<GpuPrepare> plan = decoder_model(out.item.head.model).prepare(out.item, window);
  if (!plan) {
    ADD_FAILURE() << plan.error().message;
    return out;
  }
  out.plan = *std::move(plan);
  out.item.map_params = out.plan.map_params;
  out.p = params_of<FieldParams>(out.item, 0);
  return out;
}

// ---- the passes, run here

std::uint32_t mixed(std::uint32_t i) { return i * 0x9e3779b9u >> 7; }

// A workgroup of btfc_field_recursion.comp. The order within a step must not matter: it changes.
void recursion_group(const BtfcWords& words, const FieldMemory& memory, const FieldParams& p,
                     const std::vector<std::uint32_t>& push, std::uint32_t group) {
  const std::uint32_t level = push[0], first_step = push[2], end = first_step + push[3];
  const FieldAtlasLevel a = field_atlas_level(p, level);
  const FieldUnit u = field_unit(words, p, a, level, push[1] + group);
  const FieldRun run = field_run(words, p, a, u, level, group * field_unit_words(words, p, a, level));
  std::vector<FieldWalk> walks;
  for (std::uint32_t lane = 0; lane < FIELD_LANES; ++lane)
    walks.push_back(field_walk_begin(u, lane, first_step));
  for (std::uint32_t step = first_step; step < end; ++step) {
    for (std::uint32_t i = 0; i < FIELD_LANES; ++i) {
      FieldWalk& walk = walks[i ^ (mixed(step) % FIELD_LANES)];
      if (field_walk_inside(u, walk))
        field_recursion(words, memory, p, u, run, static_cast<uint>(walk.x), walk.y);
      field_walk_on(walk);
    }
  }
}

void collapse_group(const BtfcWords& words, const FieldMemory& memory, const FieldParams& p,
                    std::uint32_t level, std::uint32_t unit, const std::array<std::uint32_t, 3>& group) {
  const FieldAtlasLevel a = field_atlas_level(p, level);
  const std::uint32_t factors = field_unit_factors(p), own = group[2] / factors;
  const FieldUnit u = field_unit(words, p, a, level, unit + own);
  for (std::uint32_t i = 0; i < 64; ++i) {
    const std::uint32_t x = group[0] * 8 + i % 8, y = group[1] * 8 + i / 8;
    if (x >= u.width || y >= u.height) continue;
    field_collapse_texel(words, memory, p, a, u, level, own * field_unit_words(words, p, a, level),
                         group[2] % factors, x, y);
  }
}

// Whatever a pass reads that no pass before it wrote becomes no number.
std::vector<std::uint32_t> run_passes(const Prepared& from) {
  std::vector<float> atlas(from.plan.made_words[2], kNone);
  std::vector<float> scratch(from.plan.scratch_bytes / sizeof(float));
  const BtfcWords words = words_of(from.item);
  const FieldMemory memory{scratch.data(), atlas.data()};
  for (const GpuPass& pass : from.plan.passes) {
    EXPECT_EQ(pass.push.size(), 4u);
    const bool recursion = std::strcmp(pass.shader, "btfc_field_recursion.comp") == 0;
    EXPECT_TRUE(recursion || std::strcmp(pass.shader, "btfc_field_collapse.comp") == 0) << pass.shader;
    for (const std::uint32_t groups : pass.groups) EXPECT_TRUE(groups > 0 && groups <= 65535) << groups;
    if (recursion && pass.push[2] == 0) std::fill(scratch.begin(), scratch.end(), kNone);
    for (std::uint32_t i = 0, count = pass.groups[0] * pass.groups[1] * pass.groups[2]; i < count; ++i) {
      if (recursion) {
        recursion_group(words, memory, from.p, pass.push, i);
      } else {
        collapse_group(
            words, memory, from.p, pass.push[0], pass.push[1],
            {i % pass.groups[0], i / pass.groups[0] % pass.groups[1], i / pass.groups[0] / pass.groups[1]});
      }
    }
  }
  std::vector<std::uint32_t> out(atlas.size());
  std::memcpy(out.data(), atlas.data(), 4 * out.size());
  return out;
}

struct Case {
  GpuWindow window;
  std::uint32_t period;
};

std::string name(const Case& c) {
  return fmt::format("{},{} {}x{} period {}", c.window.x, c.window.y, c.window.width, c.window.height,
                     c.period);
}

TEST(FieldAtlas, PassesMakeTheCpusAtlasBitForBit) {
  for (const ModelId model : kModels) {
    const LoadedItem item = loaded(file_of(make_field(rich(model)))).item;
    // One texel; odd and even origins; across 0, 2^31 and 2^32; more than one tile, one of them cut; wide and
    // low; periods below and above the margins and a tile.
    for (const Case& c :
         {Case{{5, -3, 1, 1}, 0}, Case{{-20, -33, 40, 50}, 0}, Case{{kHigh - 12, kLow, 31, 10}, 0},
          Case{{kLow, kHigh, 3, 3}, 0}, Case{{-5, 1000, 643, 7}, 0}, Case{{0, 0, 3, 330}, 0},
          Case{{0, 0, 9, 9}, 16}, Case{{7, 7, 1, 1}, 48}, Case{{0, 0, 1, 1}, 336}}) {
      const Prepared from = prepared(item, c.window, c.period);
      const std::vector<std::uint32_t> cpu = field_atlas(from.item, from.p);
      ASSERT_EQ(cpu.size(), from.plan.made_words[2]);
      EXPECT_TRUE(cpu == run_passes(from)) << name_of(from.item.head.maps[0].type) << " " << name(c);
    }
  }
}

// All factors that there may be, all neighbours, and more units than a dispatch or the scratch holds.
TEST(FieldAtlas, PassesOfLargeFiles) {
  FieldRecipe recipe;
  recipe.model = ModelId::car3d;
  recipe.channels = {4, 4, 4, 4};
  recipe.levels = 2;
  recipe.order = 40;
  recipe.margin = 12;
  recipe.whole = 0.1;
  const Prepared deep = prepared(loaded(file_of(make_field(recipe))).item, {-7, 3, 9, 4});
  EXPECT_TRUE(field_atlas(deep.item, deep.p) == run_passes(deep));

  recipe.model = ModelId::car;
  recipe.channels = {3};
  recipe.rings = 5;
  recipe.clusters = 400;
  recipe.margin = 60;
  recipe.levels = recipe.order = 1;  // quick
  const Prepared many = prepared(loaded(file_of(make_field(recipe))).item, {0, 0, 1, 1});
  EXPECT_EQ(many.plan.passes.size(), 4u);
  EXPECT_GT(many.plan.scratch_bytes, kFieldMostScratchBytes * 9 / 10);
  EXPECT_TRUE(field_atlas(many.item, many.p) == run_passes(many));
}

// ---- reading it

std::vector<BtfcQuery> queries_in(const GpuWindow& w, SplitMix64& random, std::size_t count) {
  constexpr float kFootprints[] = {1, 2, 4, 64};
  std::vector<BtfcQuery> queries(count);
  for (std::size_t i = 0; i < count; ++i) {
    BtfcQuery& q = queries[i];
    q.level = random.below(4);
    q.footprint = kFootprints[random.below(4)];
    // The corners first.
    const std::uint32_t x = i < 8 ? (i & 1) * (w.width - 1) : random.below(w.width);
    const std::uint32_t y = i < 8 ? (i >> 1 & 1) * (w.height - 1) : random.below(w.height);
    const std::uint32_t level = std::min(q.level, 2u);
    const auto place = [&](std::int32_t first, std::uint32_t at) {
      return static_cast<std::int32_t>((std::int64_t{first} + at) >> level);
    };
    q.texel = ivec2(place(w.x, x), place(w.y, y));
    const auto direction = [&] {
      return vec3(static_cast<float>(2 * random.uniform() - 1), static_cast<float>(2 * random.uniform() - 1),
                  static_cast<float>(random.uniform()));
    };
    q.view = direction();
    q.light = direction();
  }
  return queries;
}

vec4 eval(const LoadedItem& item, std::uint32_t map, const BtfcQuery& q) {
  return field_eval(words_of(item), params_of<FieldParams>(item, map), q);
}

TEST(FieldAtlas, TexelsAreThoseOfTheDirectForm) {
  for (const ModelId model : kModels) {
    const MadeField made = make_field(rich(model));
    const LoadedItem item = loaded(file_of(made)).item;
    for (const Case& c :
         {Case{{-20, -33, 40, 50}, 0}, Case{{kHigh - 12, kLow, 12, 10}, 0}, Case{{kHigh - 12, -9, 31, 12}, 0},
          Case{{kLow, 7, 1, 1}, 0}, Case{{0, 0, 1, 1}, 16}, Case{{0, 0, 1, 1}, 48}}) {
      Prepared from = prepared(item, c.window, c.period);
      from.item.words[2] = field_atlas(from.item, from.p);
      LoadedItem direct = item, hollow = from.item;
      ASSERT_TRUE(field_select(direct, {c.period, 0, 0, 0}));
      std::fill(hollow.words[2].begin(), hollow.words[2].end(), std::bit_cast<std::uint32_t>(100.0f));
      SplitMix64 random(c.period + 1);
      const GpuWindow anywhere{-1000, 500, 5000, 4000};
      for (const BtfcQuery& q : queries_in(c.period != 0 ? anywhere : c.window, random, 40)) {
        const std::uint32_t map = random.below(2), channels = map == 0 ? 3 : 1;
        const vec4 expected = eval(direct, map, q), read = eval(from.item, map, q);
        for (std::uint32_t i = 0; i < channels; ++i) {
          EXPECT_NEAR(expected[static_cast<int>(i)], read[static_cast<int>(i)], allowed(made))
              << name(c) << ", level " << q.level << ", footprint " << q.footprint;
        }
        EXPECT_NE(eval(hollow, map, q), read) << "not read from the atlas: " << name(c);
      }
    }
  }
}

// Bit for bit; and nothing of the atlas is read.
TEST(FieldAtlas, OutsideIsTheDirectForm) {
  for (const ModelId model : kModels) {
    const MadeField made = make_field(rich(model));
    const LoadedItem item = loaded(file_of(made)).item;
    const GpuWindow window{kHigh - 12, -40, 31, 12};
    Prepared from = prepared(item, window);
    from.item.words[2].assign(from.plan.made_words[2], std::bit_cast<std::uint32_t>(100.0f));
    SplitMix64 random(3);
    for (const auto& [x, y] : {std::pair{kHigh - 90, -40}, std::pair{kLow + 60, -40}, std::pair{kHigh, 40},
                               std::pair{kHigh, -90}, std::pair{0, 0}, std::pair{kLow / 2, -40}}) {
      for (const BtfcQuery& q : queries_in({x, y, 20, 20}, random, 10)) {
        const std::uint32_t map = random.below(2);
        EXPECT_EQ(eval(item, map, q), eval(from.item, map, q)) << x << "," << y << " level " << q.level;
      }
    }
    // Near the sides either way is right.
    from.item.words[2] = field_atlas(from.item, from.p);
    for (const BtfcQuery& q : queries_in({kHigh - 20, -46, 50, 26}, random, 40)) {
      const vec4 expected = eval(item, 0, q), read = eval(from.item, 0, q);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(expected[i], read[i], allowed(made));
    }
  }
}

// Levels that are not loaded have no part.
TEST(FieldAtlas, PartsOfFiles) {
  for (const ModelId model : kModels) {
    const MadeField made = make_field(rich(model));
    const Bytes file = file_of(made);
    const Result<OpenedFile> opened = open_bytes(file);
    ASSERT_TRUE(opened);
    const ByteView view(file);
    const Result<LoadedItem> item = load_item(source_of(view), *opened, 1);
    ASSERT_TRUE(item);
    const GpuWindow window{-9, 22, 30, 20};
    Prepared from = prepared(*item, window);
    ASSERT_EQ(from.p.least_level, 1u);
    from.item.words[2] = field_atlas(from.item, from.p);
    EXPECT_TRUE(from.item.words[2] == run_passes(from));
    SplitMix64 random(4);
    for (const BtfcQuery& q : queries_in(window, random, 20)) {
      const vec4 expected = eval(*item, 0, q), read = eval(from.item, 0, q);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(expected[i], read[i], allowed(made));
    }
  }
}

// ---- sizes and refusals

TEST(FieldAtlas, Sizes) {
  static_assert(sizeof(FieldParams) <= 128 && sizeof(FieldParams) % 4 == 0);
  const MadeField made = make_field(rich(ModelId::car));
  const LoadedItem item = loaded(file_of(made)).item;
  const std::uint64_t planes = 5 * 4;
  // Of 40 texels from -21: -21 … 18 at level 0, -11 … 9, -6 … 4; two more on each side.
  const Prepared from = prepared(item, {-21, 8, 40, 4});
  EXPECT_EQ(from.plan.made_words[2], planes * ((40 + 4) * (4 + 4) + (21 + 4) * (2 + 4) + (11 + 4) * (1 + 4)));
  EXPECT_EQ(from.plan.made_words[0] + from.plan.made_words[1] + from.plan.made_words[3], 0u);
  EXPECT_LE(from.plan.scratch_bytes, kFieldMostScratchBytes);
  const Prepared repeated = prepared(item, {3, 4, 5, 6}, 64);
  EXPECT_EQ(repeated.plan.made_words[2], planes * (64 * 64 + 32 * 32 + 16 * 16));
  EXPECT_EQ(repeated.p.atlas_width, 64u);
  EXPECT_EQ(repeated.p.atlas_x, 0u);
  const Prepared none = prepared(item, {77, 5, 0, 0});
  EXPECT_EQ(none.item.map_params, item.map_params);
  EXPECT_TRUE(none.plan.passes.empty());
  EXPECT_EQ(none.plan.scratch_bytes + none.plan.made_words[2], 0u);
  EXPECT_TRUE(field_atlas(item, params_of<FieldParams>(item, 0)).empty());
}

TEST(FieldAtlas, Refusals) {
  LoadedItem item = loaded(file_of(make_field(rich(ModelId::gmrf)))).item;
  const auto refused = [&](const GpuWindow& window) {
    const Result<GpuPrepare> plan = decoder_model(ModelId::gmrf).prepare(item, window);
    EXPECT_FALSE(plan);
    return plan ? Error{} : plan.error();
  };
  EXPECT_EQ(refused({0, 0, 5, 0}).message, "a window of 5 x 0 texels, expected both sides above 0, or none");
  EXPECT_EQ(refused({0, 0, 0, 5}).status, Status::bad_argument);
  const Error large = refused({0, 0, 2000, 1000});
  EXPECT_EQ(large.status, Status::limit);
  const std::uint64_t bytes = 80 * (2004 * 1004 + 1004 * 504 + 504 * 254);
  EXPECT_EQ(large.message,
            fmt::format("the prepared window of 2000 x 1000 texels of 5 subspaces of 4 factors would take {} "
                        "bytes, expected at most 134217728",
                        bytes));
  EXPECT_EQ(refused({kLow, kHigh, 0xffffffffu, 0xffffffffu}).status, Status::limit);
  EXPECT_EQ(refused({0, 0, 0xffffffffu, 1}).status, Status::limit);
  ASSERT_TRUE(field_select(item, {1u << 30, 0, 0, 0}));
  EXPECT_NE(refused({0, 0, 1, 1}).message.find("the period,"), std::string::npos);
  EXPECT_TRUE(decoder_model(ModelId::gmrf).prepare(item, {}));
  // At the limit, 20 (w + 4) 64 + …; four texels more are 20 (4 64 + 2 34 + 19) words more.
  ASSERT_TRUE(field_select(item, {}));
  std::uint32_t most = 4;
  while (decoder_model(ModelId::gmrf).prepare(item, {0, 0, most + 4, 60})) most += 4;
  const std::uint64_t words = decoder_model(ModelId::gmrf).prepare(item, {0, 0, most, 60})->made_words[2];
  EXPECT_LE(4 * words, kFieldMostAtlasBytes);
  EXPECT_GT(4 * (words + 20 * (4 * 64 + 2 * 34 + 19)), kFieldMostAtlasBytes);
}

}  // namespace
}  // namespace btfc::test
