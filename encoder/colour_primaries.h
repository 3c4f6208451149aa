// Chromaticities of the linear colour spaces, as EXR files state them.
#pragma once
#include <array>

#include "format/head.h"

namespace btfc {

// x and y of red, green, blue and white.
struct Primaries {
  ColourSpace space;
  std::array<float, 8> xy;
};

// ACES AP0, ACES AP1, Rec. 709.
inline constexpr std::array<Primaries, 3> kPrimaries = {{
    {ColourSpace::lin_ap0_scene, {0.7347f, 0.2653f, 0.0f, 1.0f, 0.0001f, -0.077f, 0.32168f, 0.33767f}},
    {ColourSpace::lin_ap1_scene, {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f}},
    {ColourSpace::lin_rec709_scene, {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f}},
}};

}  // namespace btfc
