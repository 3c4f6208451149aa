// DIRS: the directions of a BTF and which pairs of them were measured; and their tables in words
// (spec/tables.md).
#pragma once
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "format/chunk.h"
#include "format/head.h"
#include "format/result.h"
#include "format/triangulation.h"

namespace btfc {

inline constexpr std::uint32_t kDirs = four_cc("DIRS");
inline constexpr std::uint32_t kMaxTableDirections = 1024;  // rule V1
inline constexpr std::int32_t kPointUnit = 1 << 24;

struct ViewLight {
  std::uint16_t view = 0, light = 0;
  auto operator<=>(const ViewLight&) const = default;
};

struct Directions {
  std::vector<DirectionPoint> views, lights;
  std::vector<ViewLight> pairs;  // ascending, by view and then light
  bool operator==(const Directions&) const = default;
};

// All views with all lights.
std::vector<ViewLight> all_pairs(std::size_t views, std::size_t lights);

// Radians; theta 0 … pi/2.
DirectionPoint point_of(double theta, double phi);
// The unit vector that a point stands for; z >= 0 but for rounding.
std::array<double, 3> unit_vector(const DirectionPoint& point);

// What the chunk takes, from HEAD's counts alone.
ChunkSpec directions_chunk(const Head& head);
// Rule V1: HEAD's counts are fit for tables.
Result<Done> check_direction_counts(const Head& head);
Bytes write_directions(const Directions& directions);
// Rules V2 to V4; raw has the size of directions_chunk.
Result<Directions> read_directions(const Head& head, ByteView raw);

// Where tables begin in a slot's words, as shaders/btfc_directions.h reads them.
struct DirectionWords {
  std::uint32_t views = 0, lights = 0;
  std::uint32_t pairs = UINT32_MAX;  // UINT32_MAX: the full product, no table
};

// The pair that each view with each light, at view * lights + light, is answered by (spec/tables.md section
// 2): itself where it was measured, else that of the same view whose light is nearest. kNoPair where the view
// has none.
inline constexpr std::uint32_t kNoPair = UINT32_MAX;
std::vector<std::uint32_t> answering_pairs(const Directions& directions);

// Appends the tables.
DirectionWords append_direction_words(const Directions& directions, std::vector<std::uint32_t>& words);
// How many words that takes, from HEAD's counts alone: room is left for the most triangles that there can be.
std::uint64_t direction_words(const Head& head);

}  // namespace btfc
