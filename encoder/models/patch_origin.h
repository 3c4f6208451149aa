// Which texel of the sample each texel of a quilted texture shows.
#pragma once
#include <cstdint>

#include "format/loaded_item.h"
#include "format/models/patch_payload.h"
#include "shaders/models/patch.h"

namespace btfc {

// Evaluates a recipe over a sample whose codes are its own coordinates, by the shared header: what it says of
// joins and of texels that are never shown is what a decoder does. Quilting only, liang mixes texels.
class PatchOrigin {
 public:
  // Of a file; the sample that it holds is replaced.
  PatchOrigin(LoadedItem item, const PatchShape& shape);
  // Of a recipe that has not been written yet, and not been trimmed. head: the texture's size and wrapping.
  static PatchOrigin of_recipe(const Head& head, const PatchShape& shape, const PatchRecipe& recipe);

  // For x < width and y < height of the head.
  PatchPosition at(std::uint32_t x, std::uint32_t y) const {
    const uvec4 codes = patch_codes(BtfcWords{{item_.words[0].data(), item_.words[1].data(),
                                               item_.words[2].data(), item_.words[3].data()}},
                                    params_, x, y);
    return {codes.x, codes.y};
  }

 private:
  LoadedItem item_;
  PatchParams params_{};
};

}  // namespace btfc
