// A tile as a choice of texels of a data set, the same for all pairs of directions.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "format/result.h"

namespace btfc {

struct TilePoint {
  std::uint32_t x = 0, y = 0;
  bool operator==(const TilePoint&) const = default;
};

// Texel (u, v) of the tile is texel source[v * width + u] of the data set. The tile repeats.
struct TileMap {
  std::uint32_t width = 0, height = 0;
  std::vector<TilePoint> source;
  const TilePoint& at(std::uint32_t u, std::uint32_t v) const { return source[std::size_t{v} * width + u]; }
};

// The tile's texels under all pairs: a data set that wraps.
Result<Dataset> cut_tile(const Dataset& dataset, const TileMap& tile, const std::string& scratch_directory);

// Mean absolute differences of display-coded values between neighbours of the repeated tile, over all pairs
// and channels: across seams, that is neighbours that are none in the data set, and elsewhere.
struct TileSeams {
  double seams = 0, interior = 0;
  std::uint64_t seam_pairs = 0;  // of neighbours
  // 1 where seams cannot be told from the rest, above 1 where they show; 10^-6 is added to both sides.
  double ratio() const { return (seams + 1e-6) / (interior + 1e-6); }
};
TileSeams tile_seams(const Dataset& dataset, const TileMap& tile);

}  // namespace btfc
