// BTF tiling: tiles that close, join each other, and come from one place for all directions.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <set>

#include "encoder/minimum_cut.h"
#include "encoder/tiling/tile_search.h"

namespace btfc::test {
namespace {

// Images of two views: value(x, y, pair) in 0 … 255.
template <class Value>
Dataset dataset_of(std::uint32_t width, std::uint32_t height, const Value& value) {
  DatasetInfo info;
  info.width = width;
  info.height = height;
  info.channels = {"Y"};
  info.views = {direction_from_degrees(0, 0), direction_from_degrees(30, 90)};
  info.lights = {direction_from_degrees(0, 0)};
  make_full_product(info);
  Result<Dataset> dataset = Dataset::create(info, "");
  EXPECT_TRUE(dataset) << dataset.error().message;
  for (std::size_t pair = 0; pair < 2; ++pair) {
    std::vector<std::uint16_t> codes;
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        codes.push_back(static_cast<std::uint16_t>(std::lround(value(x, y, pair))));
      }
    }
    dataset->write_image(pair, codes);
  }
  return std::move(*dataset);
}

double noise_at(std::uint32_t x, std::uint32_t y, std::size_t pair) {
  std::uint64_t z = (x * 0x9e3779b97f4a7c15u) ^ (y * 0xbf58476d1ce4e5b9u) ^ (pair * 0x94d049bb133111ebu);
  z = (z ^ z >> 29) * 0xbf58476d1ce4e5b9u;
  return static_cast<double>((z ^ z >> 32) % 256);
}

// Noise that repeats every 20 columns and 14 rows, and nowhere else.
Dataset periodic(std::uint32_t size) {
  return dataset_of(size, size, [](std::uint32_t x, std::uint32_t y, std::size_t pair) {
    return noise_at(x % 20, y % 14, pair);
  });
}

TEST(Tiling, FindsThePeriod) {
  const Dataset dataset = periodic(96);
  const Result<TileSet> set = find_tiles(dataset, {});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->tiles[0].width % 20, 0u);
  EXPECT_EQ(set->tiles[0].height % 14, 0u);
  EXPECT_LT(set->seams[0].ratio(), 1.05);
}

TEST(Tiling, SeamsBetterThanPlainRepeat) {
  // Blurred noise: no period at all.
  const Dataset dataset = dataset_of(80, 72, [](std::uint32_t x, std::uint32_t y, std::size_t pair) {
    double sum = 0;
    for (std::uint32_t v = 0; v < 5; ++v) {
      for (std::uint32_t u = 0; u < 5; ++u) sum += noise_at(x + u, y + v, pair);
    }
    return sum / 25;
  });
  const Result<TileSet> set = find_tiles(dataset, {});
  ASSERT_TRUE(set);
  TileMap plain;
  plain.width = set->tiles[0].width;
  plain.height = set->tiles[0].height;
  for (std::uint32_t v = 0; v < plain.height; ++v) {
    for (std::uint32_t u = 0; u < plain.width; ++u) {
      plain.source.push_back({set->corner.x + u, set->corner.y + v});
    }
  }
  EXPECT_LT(set->seams[0].seams, 0.7 * tile_seams(dataset, plain).seams);
}

TEST(Tiling, TheSameTexelsForAllPairsAndItWraps) {
  const Dataset dataset = dataset_of(40, 40, noise_at);
  const Result<TileSet> set = find_tiles(dataset, {.size = std::pair(24u, 20u)});
  ASSERT_TRUE(set);
  const Result<Dataset> tile = cut_tile(dataset, set->tiles[0], "");
  ASSERT_TRUE(tile);
  EXPECT_TRUE(tile->info().wraps);
  for (std::size_t pair = 0; pair < 2; ++pair) {
    for (std::uint32_t v = 0; v < 20; ++v) {
      for (std::uint32_t u = 0; u < 24; ++u) {
        const TilePoint p = set->tiles[0].at(u, v);
        ASSERT_EQ(tile->code(pair, u, v, 0), dataset.code(pair, p.x, p.y, 0));
      }
    }
  }
}

TEST(Tiling, SeveralTilesShareTheirBorder) {
  const Dataset dataset = periodic(120);
  const Result<TileSet> set = find_tiles(dataset, {.size = std::pair(40u, 42u), .count = 4});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->tiles.size(), 4u);
  const TileMap& first = set->tiles[0];
  std::set<std::pair<std::uint32_t, std::uint32_t>> middles;
  for (const TileMap& tile : set->tiles) {
    middles.insert({tile.at(20, 21).x, tile.at(20, 21).y});
    for (std::uint32_t u = 0; u < 40; ++u) {
      EXPECT_EQ(tile.at(u, 0), first.at(u, 0));
      EXPECT_EQ(tile.at(u, 41), first.at(u, 41));
    }
    for (std::uint32_t v = 0; v < 42; ++v) {
      EXPECT_EQ(tile.at(0, v), first.at(0, v));
      EXPECT_EQ(tile.at(39, v), first.at(39, v));
    }
  }
  EXPECT_EQ(middles.size(), 4u);  // different inside
}

TEST(Tiling, RefusesWhatLeavesNoRoom) {
  const Dataset dataset = periodic(32);
  for (const auto& size : {std::pair(31u, 16u), std::pair(16u, 32u), std::pair(3u, 16u)}) {
    EXPECT_FALSE(find_tiles(dataset, {.size = size}));
  }
  EXPECT_FALSE(find_tiles(dataset, {.size = std::pair(24u, 24u), .count = 200}));
  EXPECT_FALSE(find_tiles(periodic(7), {}));
  EXPECT_TRUE(find_tiles(periodic(8), {}));
}

TEST(Tiling, ConstantSetHasNoSeams) {
  const Dataset dataset = dataset_of(32, 32, [](auto, auto, auto) { return 90.0; });
  const Result<TileSet> set = find_tiles(dataset, {});
  ASSERT_TRUE(set);
  EXPECT_DOUBLE_EQ(set->seams[0].ratio(), 1);
}

TEST(Tiling, ThreadsDoNotMatter) {
  const Dataset dataset = dataset_of(48, 48, noise_at);
  const auto run = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return find_tiles(dataset, {.size = std::nullopt, .count = 2}); });
  };
  const auto one = run(1), two = run(2);
  ASSERT_TRUE(one && two);
  for (std::size_t n = 0; n < 2; ++n) EXPECT_EQ(one->tiles[n].source, two->tiles[n].source);
}

TEST(MinimumCut, ClosedPathsClose) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::vector<std::uint64_t> cost(7 * 23);
    for (std::uint32_t i = 0; i < cost.size(); ++i)
      cost[i] = static_cast<std::uint64_t>(noise_at(i, seed, 3));
    const Cut closed = minimum_error_closed_cut(cost, 7, 23), open = minimum_error_cut(cost, 7, 23);
    EXPECT_LE(std::abs(closed.path.front() - closed.path.back()), 1);
    EXPECT_GE(closed.cost, open.cost);
    std::uint64_t sum = 0;
    for (std::size_t r = 0; r < 23; ++r) sum += cost[r * 7 + closed.path[r]];
    EXPECT_EQ(sum, closed.cost);
  }
}

}  // namespace
}  // namespace btfc::test
