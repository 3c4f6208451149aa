// What each light does to a relief, whatever the view: shadows, and one diffuse bounce.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/synth/btf_relief.h"

namespace btfc::procedural {

// For each grid point the places that its rays over the hemisphere meet on the relief: what does not depend
// on the light.
class BounceRays {
 public:
  explicit BounceRays(const Relief& relief);

  struct Ray {
    std::uint32_t from;  // the grid point that is met
    float weight;        // cosine at the receiver times solid angle over pi
  };
  std::span<const Ray> at(std::uint32_t column, std::uint32_t row) const;

 private:
  struct Row {
    std::vector<std::uint32_t> begin;
    std::vector<Ray> rays;
  };
  std::vector<Row> rows_;
};

// Lights are the innermost index, so that loops over them read along memory.
struct LightMaps {
  std::size_t lights = 0;
  std::vector<float> maps;  // [grid point][visibility, bounced red, green, blue][light]

  const float* at(std::uint32_t point) const { return maps.data() + point * 4 * lights; }
};

// Visibility is the part of the lamp's disk above the horizon, 0 … 1. The bounce is the light that arrives
// from the relief, of the same unit as the lamp's cosine: 1 is a lamp straight above.
LightMaps light_maps(const Relief& relief, const BounceRays& rays, std::span<const ReliefDirection> lights);

}  // namespace btfc::procedural
