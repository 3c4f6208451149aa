// A texture decoded by its shaders on a Vulkan device; without Vulkan's headers, so that all may include it.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "btfc/btfc.h"
#include "format/result.h"

namespace btfc {

struct VulkanOptions {
  bool validation = false;  // the validation layer: what it says stands in messages()
  bool robust = false;      // btfc.glsl's robust mode
  bool linear = false;      // interpolation between texels in samples
  bool baked = true;        // parameters as specialisation constants
  bool general = false;     // the entry points for any model in place of those for one
  btfc_gpu_window window{};
};

// What shaders read of a texture: the model's number, word arrays, and the parameters of each map, of which
// the first fixed_params words are the same whatever is prepared.
struct ShaderData {
  std::uint32_t model = 0;
  std::array<std::vector<std::uint32_t>, BTFC_WORD_SLOTS> words;
  std::vector<btfc_gpu_params> params;
  std::uint32_t fixed_params = 32;
};

Result<ShaderData> shader_data(const btfc_texture* texture);

enum class ShaderStage { compute, fragment };

// An argument of btfc_sample.
struct ShaderSample {
  std::array<float, 2> uv;
  std::array<float, 3> view, light;
  float footprint;
};

// Texels a second of the same workgroups, in turns: medians.
struct ShaderRates {
  double full, fetch;                // each invocation its own texel; from an RGBA8 image
  double random_full, random_fetch;  // each invocation eight random texels
  std::uint32_t width, height;       // of the invocations: of slow models less than was asked for
};

class VulkanTexture;

// One thread. Values come as four floats a query; channels that the map lacks are undefined.
class VulkanDecoder {
 public:
  // texture must outlive the decoder.
  static Result<VulkanDecoder> open(const btfc_texture* texture, const VulkanOptions& options);
  // Of data that no loader has checked, say; nothing is prepared.
  static Result<VulkanDecoder> open(const ShaderData& data, const VulkanOptions& options);
  VulkanDecoder(VulkanDecoder&&) noexcept;
  VulkanDecoder& operator=(VulkanDecoder&&) noexcept;
  ~VulkanDecoder();

  const std::string& device_name() const;
  const std::vector<std::string>& messages() const;

  // Another window of an unbounded texture in place of the one before. Of other textures nothing.
  Result<Done> prepare(const btfc_gpu_window& window);

  Result<std::vector<float>> rectangle(ShaderStage stage, std::uint32_t map,
                                       const btfc_directions& directions, std::int32_t x, std::int32_t y,
                                       std::uint32_t width, std::uint32_t height);
  // All of one map.
  Result<std::vector<float>> queries(ShaderStage stage, std::uint32_t map,
                                     std::span<const btfc_query> queries);
  Result<std::vector<float>> samples(ShaderStage stage, std::uint32_t map,
                                     std::span<const ShaderSample> samples);
  // rgba8: an image of that size, what the plain fetches read.
  Result<ShaderRates> rates(std::uint32_t map, const btfc_directions& directions, std::uint32_t width,
                            std::uint32_t height, std::span<const std::byte> rgba8, double seconds);

 private:
  explicit VulkanDecoder(std::unique_ptr<VulkanTexture> texture);
  std::unique_ptr<VulkanTexture> texture_;
};

}  // namespace btfc
