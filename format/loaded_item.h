// A file's item as a decoder holds it: parameter structs, word arrays and planes, the same for CPU and
// shader.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "format/directions.h"
#include "format/head.h"

namespace btfc {

inline constexpr std::size_t kWordSlots = 4;

// A 2-D array of texels inside a word slot; an engine may hold it as an image instead.
struct Plane {
  std::uint32_t width = 0, height = 0;  // texels
  std::uint32_t channels = 0;
  std::uint32_t texel_bits = 0;  // channels padded to 1, 2 or 4
  SampleType type = SampleType::unorm8;
  std::uint32_t slot = 0;
  std::uint32_t first_word = 0;
};

// Immutable once loaded; readable from many threads. What was selected at loading lies in the parameters;
// `culling`, which shaders do not know, is the share of the weights that gm's fast paths may leave out.
struct LoadedItem {
  Head head;
  std::array<std::vector<std::uint32_t>, kWordSlots> words;
  std::vector<std::vector<std::uint32_t>> map_params;  // one params struct a map, as 32-bit words
  std::vector<Plane> planes;
  Directions directions;  // empty lists where the model has no directions
  float culling = 0;      // 0: the decoder's own
};

}  // namespace btfc
