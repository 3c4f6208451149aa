// The light of an environment map as lights from single directions.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/image.h"
#include "format/result.h"
#include "tools/vulkan_render.h"

namespace btfc {

// image: latitude and longitude, linear red, green, blue (or one channel), the top row upwards (y), the
// middle column behind the object (-z), to the right of it what is on the right (x). At most `count` lights,
// by the median cut of Debevec 2005: the region with the most light is cut in two halves of as much light,
// until there are enough; each becomes a light in its mean direction. Where all radiance is 1, a white
// diffuse surface shows 1.
Result<std::vector<RenderLight>> environment_lights(const Image& image, std::uint32_t count);

}  // namespace btfc
