// In place of the Vulkan runner where btfc is built without Vulkan's headers.
#include "tools/vulkan_decoder.h"
#include "tools/vulkan_render.h"

namespace btfc {

class VulkanTexture {};

VulkanDecoder::VulkanDecoder(std::unique_ptr<VulkanTexture> texture) : texture_(std::move(texture)) {}
VulkanDecoder::VulkanDecoder(VulkanDecoder&&) noexcept = default;
VulkanDecoder& VulkanDecoder::operator=(VulkanDecoder&&) noexcept = default;
VulkanDecoder::~VulkanDecoder() = default;

namespace {

Error absent() { return unsupported("", 0, "this btfc was built without Vulkan"); }

}  // namespace

Result<ShaderData> shader_data(const btfc_texture*) { return absent(); }
Result<VulkanDecoder> VulkanDecoder::open(const btfc_texture*, const VulkanOptions&) { return absent(); }
Result<VulkanDecoder> VulkanDecoder::open(const ShaderData&, const VulkanOptions&) { return absent(); }
const std::string& VulkanDecoder::device_name() const {
  static const std::string none;
  return none;
}
const std::vector<std::string>& VulkanDecoder::messages() const {
  static const std::vector<std::string> none;
  return none;
}
Result<Done> VulkanDecoder::prepare(const btfc_gpu_window&) { return absent(); }
Result<std::vector<float>> VulkanDecoder::rectangle(ShaderStage, std::uint32_t, const btfc_directions&,
                                                    std::int32_t, std::int32_t, std::uint32_t,
                                                    std::uint32_t) {
  return absent();
}
Result<std::vector<float>> VulkanDecoder::queries(ShaderStage, std::uint32_t, std::span<const btfc_query>) {
  return absent();
}
Result<std::vector<float>> VulkanDecoder::samples(ShaderStage, std::uint32_t, std::span<const ShaderSample>) {
  return absent();
}
Result<ShaderRates> VulkanDecoder::rates(std::uint32_t, const btfc_directions&, std::uint32_t, std::uint32_t,
                                         std::span<const std::byte>, double) {
  return absent();
}

class RenderTarget {};

VulkanRenderer::VulkanRenderer(std::unique_ptr<RenderTarget> target) : target_(std::move(target)) {}
VulkanRenderer::VulkanRenderer(VulkanRenderer&&) noexcept = default;
VulkanRenderer::~VulkanRenderer() = default;
Result<VulkanRenderer> VulkanRenderer::open(const btfc_texture*, const VulkanOptions&, const ShapeMesh&,
                                            std::uint32_t, std::uint32_t, std::uint32_t) {
  return absent();
}
const std::string& VulkanRenderer::device_name() const {
  static const std::string none;
  return none;
}
const std::vector<std::string>& VulkanRenderer::messages() const {
  static const std::vector<std::string> none;
  return none;
}
Result<std::vector<float>> VulkanRenderer::picture(const RenderScene&, std::span<const RenderLight>) {
  return absent();
}

}  // namespace btfc
