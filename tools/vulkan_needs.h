// What a device must be able to do, held against what one can: apart from Vulkan, so that it is testable
// without.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace btfc {

struct VulkanNeeds {
  std::uint64_t storage_bytes = std::uint64_t{1} << 27;  // of one storage buffer
  std::uint32_t storage_buffers = 4;                     // a stage
  std::uint32_t image_side = 4096;                       // texels
};

// Facts about a device. Defaults: none at all.
struct VulkanFacts {
  std::string name;
  std::uint32_t version = 0;  // major << 22 | minor << 12
  bool graphics_and_compute = false;
  std::uint64_t storage_bytes = 0;
  std::uint32_t storage_buffers = 0, push_bytes = 0, image_side = 0;
  bool float_target = false;  // R32G32B32A32_SFLOAT as storage image and colour attachment
};

// What a device lacks, as a sentence's second half ("it has …, expected …"); nothing where it has all.
std::optional<std::string> missing_for(const VulkanFacts& has, const VulkanNeeds& needs);

}  // namespace btfc
