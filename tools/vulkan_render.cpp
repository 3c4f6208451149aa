// The pipeline that draws a mesh, its targets and buffers.
#include "tools/vulkan_render.h"

#include <array>
#include <cstddef>
#include <cstring>

#include "tools/vulkan_shaders.h"
#include "tools/vulkan_texture.h"

namespace btfc {
namespace {

constexpr vk::Format kColour = vk::Format::eR32G32B32A32Sfloat;
constexpr vk::Format kDepth = vk::Format::eD16Unorm;  // what every device has

constexpr vk::VertexInputAttributeDescription kAttributes[] = {
    {0, 0, vk::Format::eR32G32B32Sfloat, offsetof(ShapeVertex, position)},
    {1, 0, vk::Format::eR32G32B32Sfloat, offsetof(ShapeVertex, normal)},
    {2, 0, vk::Format::eR32G32B32Sfloat, offsetof(ShapeVertex, tangent)},
    {3, 0, vk::Format::eR32G32Sfloat, offsetof(ShapeVertex, uv)}};

}  // namespace

class RenderTarget {
 public:
  RenderTarget(std::unique_ptr<VulkanTexture> texture, const ShapeMesh& mesh, std::uint32_t map,
               std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> fragment,
               std::uint32_t width, std::uint32_t height)
      : texture_(std::move(texture)), index_count_(static_cast<std::uint32_t>(mesh.triangles.size())) {
    VulkanDevice& device = texture_->device();
    using Usage = vk::BufferUsageFlagBits;
    vertices_ = device.make_buffer(std::span(mesh.vertices).size_bytes(), Usage::eVertexBuffer);
    device.upload(vertices_, std::as_bytes(std::span(mesh.vertices)));
    indices_ = device.make_buffer(std::span(mesh.triangles).size_bytes(), Usage::eIndexBuffer);
    device.upload(indices_, std::as_bytes(std::span(mesh.triangles)));
    scene_ = device.make_buffer(sizeof(RenderScene), Usage::eUniformBuffer);
    colour_ =
        device.make_image(width, height, kColour,
                          vk::ImageUsageFlagBits::eColorAttachment | vk::ImageUsageFlagBits::eTransferSrc);
    depth_ = device.make_image(width, height, kDepth, vk::ImageUsageFlagBits::eDepthStencilAttachment,
                               vk::ImageAspectFlagBits::eDepth);
    render_pass_ = device.make_render_pass(kColour, kDepth);
    const vk::ImageView views[] = {*colour_.view, *depth_.view};
    framebuffer_ = {device.device(), vk::FramebufferCreateInfo({}, *render_pass_, views, width, height, 1)};

    std::vector<GpuBinding> bound = texture_->bindings(map);
    bound.push_back({vk::DescriptorType::eUniformBuffer, &scene_});
    std::vector<vk::DescriptorType> types;
    for (const GpuBinding& binding : bound) types.push_back(binding.type);
    const std::vector<GpuConstant> constants = texture_->constants(map);
    VulkanDevice::Graphics graphics;
    graphics.vertex = vertex;
    graphics.fragment = fragment;
    graphics.bindings = types;
    graphics.push_size = sizeof(RenderLight);
    graphics.constants = constants;
    graphics.colour = kColour;
    graphics.depth = kDepth;
    graphics.attributes = kAttributes;
    graphics.vertex_stride = sizeof(ShapeVertex);
    pipeline_ = device.make_graphics(graphics, render_pass_);
    set_ = device.make_set(pipeline_, bound);
  }

  VulkanDevice& device() { return texture_->device(); }

  std::vector<float> picture(const RenderScene& scene, std::span<const RenderLight> lights) {
    device().upload(scene_, std::as_bytes(std::span(&scene, 1)));
    std::vector<float> sum(std::size_t{4} * colour_.width * colour_.height);
    std::vector<float> one(sum.size());
    for (const RenderLight& light : lights) {
      device().submit([&](const vk::raii::CommandBuffer& commands) { draw(commands, light); });
      const std::vector<std::byte> bytes = device().download(colour_, 4 * sizeof(float));
      std::memcpy(one.data(), bytes.data(), bytes.size());
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = i % 4 == 3 ? one[i] : sum[i] + one[i];
    }
    return sum;
  }

 private:
  void draw(const vk::raii::CommandBuffer& commands, const RenderLight& light) {
    const vk::Rect2D area({0, 0}, {colour_.width, colour_.height});
    const vk::ClearValue clear[] = {vk::ClearColorValue(std::array<float, 4>{}),
                                    vk::ClearDepthStencilValue(1, 0)};
    commands.beginRenderPass(vk::RenderPassBeginInfo(*render_pass_, *framebuffer_, area, clear),
                             vk::SubpassContents::eInline);
    commands.bindPipeline(vk::PipelineBindPoint::eGraphics, *pipeline_.pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eGraphics, *pipeline_.layout, 0, *set_.set, {});
    commands.setViewport(
        0, vk::Viewport(0, 0, static_cast<float>(colour_.width), static_cast<float>(colour_.height), 0, 1));
    commands.setScissor(0, area);
    commands.pushConstants<RenderLight>(*pipeline_.layout, pipeline_.stages, 0, light);
    commands.bindVertexBuffers(0, *vertices_.buffer, vk::DeviceSize{0});
    commands.bindIndexBuffer(*indices_.buffer, 0, vk::IndexType::eUint32);
    commands.drawIndexed(index_count_, 1, 0, 0, 0);
    commands.endRenderPass();
  }

  std::unique_ptr<VulkanTexture> texture_;  // first: its device outlives the rest
  std::uint32_t index_count_;
  GpuBuffer vertices_, indices_, scene_;
  GpuImage colour_, depth_;
  vk::raii::RenderPass render_pass_ = nullptr;
  vk::raii::Framebuffer framebuffer_ = nullptr;
  GpuPipeline pipeline_;
  GpuSet set_;
};

VulkanRenderer::VulkanRenderer(std::unique_ptr<RenderTarget> target) : target_(std::move(target)) {}
VulkanRenderer::VulkanRenderer(VulkanRenderer&&) noexcept = default;
VulkanRenderer::~VulkanRenderer() = default;

Result<VulkanRenderer> VulkanRenderer::open(const btfc_texture* texture, const VulkanOptions& options,
                                            const ShapeMesh& mesh, std::uint32_t map, std::uint32_t width,
                                            std::uint32_t height) {
  const auto vertex = general_shader("btfc_render.vert");
  if (!vertex) return vertex.error();
  const Result<ShaderData> data = shader_data(texture);
  if (!data) return data.error();
  Result<std::unique_ptr<VulkanDevice>> device = VulkanDevice::open({}, options.validation);
  if (!device) return device.error();
  return vulkan_call([&]() -> Result<VulkanRenderer> {
    auto held = std::make_unique<VulkanTexture>(std::move(*device), *data, texture, options);
    if (options.window.width > 0) {
      if (const auto done = held->prepare(options.window); !done) return done.error();
    }
    const auto fragment = held->shader("btfc_render.frag");
    if (!fragment) return fragment.error();
    return VulkanRenderer(
        std::make_unique<RenderTarget>(std::move(held), mesh, map, *vertex, *fragment, width, height));
  });
}

const std::string& VulkanRenderer::device_name() const { return target_->device().name(); }
const std::vector<std::string>& VulkanRenderer::messages() const { return target_->device().messages(); }

Result<std::vector<float>> VulkanRenderer::picture(const RenderScene& scene,
                                                   std::span<const RenderLight> lights) {
  return vulkan_call([&]() -> Result<std::vector<float>> { return target_->picture(scene, lights); });
}

}  // namespace btfc
