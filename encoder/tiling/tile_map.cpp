// Gathering a tile's texels, and judging its seams.
#include "encoder/tiling/tile_map.h"

#include <tbb/parallel_for.h>

#include "encoder/tiling/display_codes.h"

namespace btfc {

Result<Dataset> cut_tile(const Dataset& dataset, const TileMap& tile, const std::string& scratch_directory) {
  DatasetInfo info = dataset.info();
  info.width = tile.width;
  info.height = tile.height;
  info.wraps = true;
  Result<Dataset> out = Dataset::create(info, scratch_directory);
  if (!out) return out;
  const std::size_t channels = info.channels.size();
  tbb::parallel_for(std::size_t{0}, info.pairs.size(), [&](std::size_t pair) {
    const Image image = dataset.image(pair);
    std::vector<std::uint16_t> codes(info.image_samples());
    auto* to = codes.data();
    for (const TilePoint& from : tile.source) {
      const std::uint16_t* texel = &image.codes[image.index(from.x, from.y, 0)];
      to = std::copy_n(texel, channels, to);
    }
    out->write_image(pair, codes);
  });
  return out;
}

TileSeams tile_seams(const Dataset& dataset, const TileMap& tile) {
  // Neighbours to the right and below, as indices of texels of the data set.
  struct Edge {
    std::size_t a, b;
  };
  std::vector<Edge> edges[2];  // inside, across seams
  const std::size_t width = dataset.info().width, channels = dataset.info().channels.size();
  const auto index = [&](const TilePoint& p) { return (p.y * width + p.x) * channels; };
  for (std::uint32_t v = 0; v < tile.height; ++v) {
    for (std::uint32_t u = 0; u < tile.width; ++u) {
      const TilePoint& here = tile.at(u, v);
      const TilePoint &right = tile.at((u + 1) % tile.width, v), &below = tile.at(u, (v + 1) % tile.height);
      edges[right != TilePoint{here.x + 1, here.y}].push_back({index(here), index(right)});
      edges[below != TilePoint{here.x, here.y + 1}].push_back({index(here), index(below)});
    }
  }
  const DisplayCodes display(dataset.info());
  const std::size_t pairs = dataset.info().pairs.size();
  std::vector<std::uint64_t> sums(2 * pairs);
  tbb::parallel_for(std::size_t{0}, pairs, [&](std::size_t pair) {
    const std::vector<std::uint16_t> codes = display.image(dataset, pair);
    for (int kind = 0; kind < 2; ++kind) {
      std::uint64_t sum = 0;
      for (const Edge& e : edges[kind]) {
        for (std::size_t c = 0; c < channels; ++c) {
          const int difference = codes[e.a + c] - codes[e.b + c];
          sum += static_cast<std::uint64_t>(difference < 0 ? -difference : difference);
        }
      }
      sums[2 * pair + static_cast<std::size_t>(kind)] = sum;
    }
  });
  const auto mean = [&](std::size_t kind) {
    std::uint64_t sum = 0;
    for (std::size_t pair = 0; pair < pairs; ++pair) sum += sums[2 * pair + kind];
    const double count = static_cast<double>(edges[kind].size() * channels * pairs);
    return count == 0 ? 0 : static_cast<double>(sum) / DisplayCodes::kOne / count;
  };
  return {mean(1), mean(0), edges[1].size()};
}

}  // namespace btfc
