// Patch-based texture synthesis that keeps its recipe (paper, section III).
#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "encoder/image.h"
#include "format/models/patch_payload.h"

namespace btfc {

struct SynthesisSettings {
  double tau = 0.2;  // the paper's threshold constant
  // Quilting: of so many candidates, drawn at random, the one whose cuts cost least is taken. 1: the paper's
  // choice.
  std::uint32_t tries = 1;
  std::uint64_t seed = 1;
  bool plain_search = false;  // the reference search instead of the fast one: same recipe
  std::function<void(std::size_t done, std::size_t total)> progress;  // in patches
};

// Takes finished rows of the synthesised texture, from the top: row y of every map, full width.
using RowSink = std::function<void(std::uint32_t y, std::span<const std::uint16_t* const> maps)>;

// Synthesises the whole texture from the maps' samples (all of the shape's sample size) and returns the
// recipe. Holds two strips of patches, never the texture; sink may be empty. Runs on the calling oneTBB
// arena; the recipe does not depend on it.
PatchRecipe synthesize_patches(const PatchShape& shape, std::span<const Image> samples,
                               const SynthesisSettings& settings, const RowSink& sink);

}  // namespace btfc
