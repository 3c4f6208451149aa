// Procedural stand-ins for texture photographs, for tests of the patch model.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

struct TextureKind {
  const char* name;
  const char* texture_class;  // regular | near-regular | irregular | stochastic
  const char* summary;
};
std::span<const TextureKind> texture_kinds();

struct TextureOptions {
  std::uint32_t width = 512, height = 512;
  std::uint64_t seed = 1;  // another sample of the same material
  SampleType type = SampleType::unorm8;
};

// unorm8 and unorm16: RGB in srgb_rec709_scene; float16: RGB in lin_rec709_scene with highlights above 1.
// Same kind and options give the same codes on any machine with IEEE 754 binary64. A texel depends on its
// position only, so that a smaller image is the top left corner of a larger one. An unknown kind (the message
// lists the kinds) or a side of 0 is bad_argument. Thread-safe.
Result<Image> synthesize_texture(std::string_view kind, const TextureOptions& options);

}  // namespace btfc
