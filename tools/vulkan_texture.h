// A texture's words and parameters in a device's memory, prepared, and its decoding pipelines.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "btfc/btfc.h"
#include "tools/vulkan_decoder.h"
#include "tools/vulkan_device.h"
#include "tools/vulkan_shaders.h"

namespace btfc {

// The push constants of btfc_decode.glsl.
struct DecodePush {
  float view[4];   // w: footprint
  float light[4];  // w: free
  std::int32_t origin[2];
  std::uint32_t size[2];
  std::uint32_t level;
  std::uint32_t source;
};

class VulkanTexture {
 public:
  // Uploads. texture: what data is of, for windows, and must outlive it; or null.
  VulkanTexture(std::unique_ptr<VulkanDevice> device, const ShaderData& data, const btfc_texture* texture,
                const VulkanOptions& options);
  // Runs the passes of a window's plan, in place of those before.
  Result<Done> prepare(const btfc_gpu_window& window);

  VulkanDevice& device() { return *device_; }
  // Bindings 0 to 4 of btfc_bindings.glsl, and what is made of specialisation constants.
  std::vector<GpuBinding> bindings(std::uint32_t map) const;
  std::vector<GpuConstant> constants(std::uint32_t map) const;

  // Of the entry point for this texture's model.
  Result<std::span<const std::uint32_t>> shader(const std::string& entry) const;

  // width x height values; queries: three texels of four words for each, or empty.
  // entry: btfc_decode or btfc_sample.
  std::vector<float> decode(const std::string& entry, ShaderStage stage, std::uint32_t map,
                            const DecodePush& push, std::span<const std::uint32_t> queries);
  ShaderRates rates(std::uint32_t map, const btfc_directions& directions, std::uint32_t width,
                    std::uint32_t height, std::span<const std::byte> rgba8, double seconds);

 private:
  // What one stage and map decodes with.
  struct Decoding {
    GpuPipeline pipeline;
    vk::raii::RenderPass render_pass = nullptr;
  };
  Decoding& decoding(const std::string& entry, ShaderStage stage, std::uint32_t map);
  void run(std::span<const btfc_gpu_pass> passes, std::uint64_t scratch_size);
  void write_params(std::span<const btfc_gpu_params> params);
  const GpuImage& values_image(std::uint32_t width, std::uint32_t height);
  // With the queries, or of one texel where there are none.
  const GpuImage& queries_image(std::uint32_t width, std::uint32_t height,
                                std::span<const std::uint32_t> queries);

  std::unique_ptr<VulkanDevice> device_;
  const btfc_texture* texture_;
  VulkanOptions options_;
  std::uint32_t model_ = 0, fixed_params_ = 0;
  std::vector<btfc_gpu_params> params_;
  std::array<GpuBuffer, BTFC_WORD_SLOTS> words_;
  GpuBuffer uniforms_, scratch_;
  std::uint64_t uniform_stride_ = 256;
  GpuImage values_, queries_;
  std::map<std::tuple<std::string, ShaderStage, std::uint32_t>, Decoding> decodings_;
  std::map<std::string, GpuPipeline> passes_;
};

}  // namespace btfc
