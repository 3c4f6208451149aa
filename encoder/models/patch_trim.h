// Trimming: which part of the sample a texture shows (paper, Fig. 8).
#pragma once
#include "format/models/patch_payload.h"

namespace btfc {

// The share of the sample's texels that some texel of the texture shows, 0 to 1. With apply, and where it
// makes the payload smaller, also sets shape.stored_blocks and recipe.blocks, so that only the blocks with
// such a texel are stored.
double trim_sample(const Head& head, PatchShape& shape, PatchRecipe& recipe, bool apply);

}  // namespace btfc
