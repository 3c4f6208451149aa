// Light that leaves the relief towards a view, under all lights at once.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/synth/btf_light.h"
#include "encoder/synth/btf_relief.h"

namespace btfc::procedural {

// values[(t * 3 + channel) * lights + light] = pi f_r cos(theta) plus bounce of texel x + t of row y, linear,
// 0 and more: the mean over the texel's rays. The maps are those of these lights.
void shade_texels(const Relief& relief, const LightMaps& maps, std::span<const ReliefDirection> lights,
                  const ReliefDirection& view, std::uint32_t x, std::uint32_t y, std::uint32_t count,
                  std::span<float> values);

}  // namespace btfc::procedural
