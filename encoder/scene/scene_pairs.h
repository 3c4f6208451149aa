// From a scene and what was measured to the pairs that the scene needs.
#pragma once
#include "encoder/dataset/pair_choice.h"
#include "encoder/scene/scene_file.h"

namespace btfc {

// The measured pairs that a decoder answers the scene's directions from, and how often each is asked for
// (spec/scene.md). A pair that was not measured is left to the one that stands for it (spec/tables.md
// section 2). Of a scene without directions all pairs, all alike.
Result<PairChoice> scene_pairs(const Scene& scene, const DatasetInfo& measured);

// What DOMN says of a file made for a scene; x and y: texel (0, 0) in the original.
Domain scene_domain(const Scene& scene, std::uint32_t x, std::uint32_t y);

}  // namespace btfc
