// Facts against needs.
#include "tools/vulkan_needs.h"

#include <fmt/format.h>

namespace btfc {

std::optional<std::string> missing_for(const VulkanFacts& has, const VulkanNeeds& needs) {
  constexpr std::uint32_t kMajor = 22, kMinor = 12, kLeast = 1u << kMajor | 1u << kMinor;
  constexpr std::uint32_t kPushBytes = 128;
  if (has.version < kLeast) {
    return fmt::format("it has Vulkan {}.{}, expected 1.1 or later", has.version >> kMajor,
                       has.version >> kMinor & 0x3ff);
  }
  if (!has.graphics_and_compute) return "it has no queue for both graphics and compute, expected one";
  if (has.storage_bytes < needs.storage_bytes) {
    return fmt::format("it has storage buffers of {} bytes, expected {}", has.storage_bytes,
                       needs.storage_bytes);
  }
  if (has.storage_buffers < needs.storage_buffers)
    return fmt::format("it has {} storage buffers a stage, expected {}", has.storage_buffers,
                       needs.storage_buffers);
  if (has.push_bytes < kPushBytes)
    return fmt::format("it has {} bytes of push constants, expected {}", has.push_bytes, kPushBytes);
  if (has.image_side < needs.image_side)
    return fmt::format("it has images of {} texels a side, expected {}", has.image_side, needs.image_side);
  if (!has.float_target) return "it cannot render to images of four 32-bit floats";
  return std::nullopt;
}

}  // namespace btfc
