// Pictures of a textured surface by a Vulkan device; without Vulkan's headers, so that all may include it.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "btfc/btfc.h"
#include "format/result.h"
#include "tools/render_shapes.h"
#include "tools/vulkan_decoder.h"

namespace btfc {

// The uniform buffer of shaders/btfc_render.glsl; matrices by columns.
struct RenderScene {
  float clip_from_object[16];
  float world_from_object[16];
  float viewer[4];
  float least_view_z, least_light_z;
  std::uint32_t channels, srgb_coded, holds_cosine, cut_to_extent;
};

// The push constants of shaders/btfc_render.glsl; the fourth numbers are free.
struct RenderLight {
  float direction[4];
  float strength[4];
};

class RenderTarget;

// One thread.
class VulkanRenderer {
 public:
  // texture must outlive the renderer. Pictures are of width x height texels at most; options.window: as of
  // VulkanDecoder.
  static Result<VulkanRenderer> open(const btfc_texture* texture, const VulkanOptions& options,
                                     const ShapeMesh& mesh, std::uint32_t map, std::uint32_t width,
                                     std::uint32_t height);
  VulkanRenderer(VulkanRenderer&&) noexcept;
  ~VulkanRenderer();

  const std::string& device_name() const;
  const std::vector<std::string>& messages() const;

  // Linear red, green, blue, and 1 where the surface is, 0 elsewhere; rows from the top. A submission a
  // light: devices end what takes too long, and bound the loops of an invocation.
  Result<std::vector<float>> picture(const RenderScene& scene, std::span<const RenderLight> lights);

 private:
  explicit VulkanRenderer(std::unique_ptr<RenderTarget> target);
  std::unique_ptr<RenderTarget> target_;
};

}  // namespace btfc
