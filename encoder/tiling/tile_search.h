// BTF tiling, the survey's enlargement method (refs 81 and 35): a toroidal tile cut out of the data along
// minimum error paths that are common to all pairs of directions, and sets of tiles that join each other.
#pragma once
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "encoder/tiling/tile_map.h"

namespace btfc {

struct TileOptions {
  // Width and height; nothing: the size, too, is searched, from a quarter of the data set's sides on.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> size;
  std::uint32_t count = 1;  // tiles; all have the border of the first, so that any may lie beside any
};

struct TileSet {
  std::vector<TileMap> tiles;
  TilePoint corner;              // of the first tile's window in the data set
  std::uint32_t overlap = 0;     // width of the bands in which the paths run, texels
  std::vector<TileSeams> seams;  // of each tile, repeated
};

// Windows of w x h texels and an overlap beyond them are searched on a grid of places and sizes, by the least
// errors that paths could have, over a spread of pairs; the best of them by their true paths. The paths that
// are used come from all pairs. Further tiles hold other windows inside the first one's border. Refused: a
// size that leaves no room for an overlap of at least 2 texels, a data set smaller than 8 texels a side, more
// tiles than there are windows. Deterministic; uses the threads of the calling oneTBB arena.
Result<TileSet> find_tiles(const Dataset& dataset, const TileOptions& options);

}  // namespace btfc
