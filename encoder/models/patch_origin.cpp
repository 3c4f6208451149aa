// The sample of coordinates: one word a texel, x in the lower half.
#include "encoder/models/patch_origin.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace btfc {

PatchOrigin::PatchOrigin(LoadedItem item, const PatchShape& s) : item_(std::move(item)) {
  std::memcpy(&params_, item_.map_params[0].data(), sizeof params_);
  params_.plane_word = 0;
  params_.texel_bits = 32;
  params_.sample_type = BTFC_CODE_UNORM16;
  std::vector<std::uint32_t>& sample = item_.words[PATCH_SAMPLE];
  sample.clear();
  sample.reserve(std::size_t{s.sample_width} * s.sample_height);
  for (std::uint32_t y = 0; y < s.sample_height; ++y) {
    for (std::uint32_t x = 0; x < s.sample_width; ++x) sample.push_back(y << 16 | x);
  }
}

PatchOrigin PatchOrigin::of_recipe(const Head& head, const PatchShape& shape, const PatchRecipe& recipe) {
  Head grey = head;  // the recipe alone matters: the smallest sample goes through the format layer
  Map map;
  map.channels = 1;
  grey.maps = {map};
  PatchShape whole = shape;
  whole.stored_blocks = 0;
  const SampleCodes codes(std::size_t{shape.sample_width} * shape.sample_height);
  std::vector<RawChunk> chunks = patch_write(grey, whole, recipe, {&codes, 1});
  const ChunkReader reader = [&](const ChunkKey& key) -> Result<Bytes> {
    const auto found = std::find_if(chunks.begin(), chunks.end(),
                                    [&](const RawChunk& c) { return c.key.order() == key.order(); });
    return std::move(found->raw);
  };
  // What the format layer wrote it also loads: the shape has been checked, the recipe is ours.
  return PatchOrigin(*patch_load(grey, write_patch_parm(whole), reader, kAllLevels), whole);
}

}  // namespace btfc
