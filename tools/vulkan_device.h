// A Vulkan device without a window: memory, buffers, images, pipelines, and one submission at a time. For the
// command and the tests; the decoder library makes no Vulkan call.
//
// Functions throw vk::SystemError where Vulkan fails; vulkan_call() below turns that into a Result. One
// thread.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "format/result.h"
#include "tools/vulkan_needs.h"

namespace btfc {

// A buffer in the device's memory, or where the host sees it.
struct GpuBuffer {
  vk::raii::Buffer buffer = nullptr;
  std::uint64_t size = 0;
  std::byte* mapped = nullptr;  // of host-visible ones
};

struct GpuImage {
  vk::raii::Image image = nullptr;
  vk::raii::ImageView view = nullptr;
  vk::Format format = vk::Format::eUndefined;
  std::uint32_t width = 0, height = 0;
};

// Specialisation constants: id and value.
struct GpuConstant {
  std::uint32_t id, value;
};

// A pipeline with its layouts: one descriptor set, push constants for the stages given.
struct GpuPipeline {
  vk::raii::DescriptorSetLayout set_layout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
  vk::ShaderStageFlags stages;
};

// One binding of a descriptor set.
struct GpuBinding {
  vk::DescriptorType type;
  const GpuBuffer* buffer = nullptr;
  std::uint64_t offset = 0, range = VK_WHOLE_SIZE;
  const GpuImage* image = nullptr;
  vk::Sampler sampler = {};
};

struct GpuSet {
  vk::raii::DescriptorPool pool = nullptr;
  vk::raii::DescriptorSet set = nullptr;
};

class VulkanDevice {
 public:
  // The first device that has what `needs` says, discrete ones first; an error says what is missing.
  // validation: with the validation layer, its best practices and synchronisation checks.
  static Result<std::unique_ptr<VulkanDevice>> open(const VulkanNeeds& needs, bool validation);

  const std::string& name() const { return name_; }
  const vk::raii::Device& device() const { return device_; }
  std::uint64_t uniform_alignment() const { return uniform_alignment_; }
  // What the validation layer said so far.
  const std::vector<std::string>& messages() const { return *messages_; }

  // Memory goes back with the device, not before.
  GpuBuffer make_buffer(std::uint64_t size, vk::BufferUsageFlags usage, bool host_visible = false);
  GpuImage make_image(std::uint32_t width, std::uint32_t height, vk::Format format, vk::ImageUsageFlags usage,
                      vk::ImageAspectFlags aspect = vk::ImageAspectFlagBits::eColor);

  // shader: SPIR-V. bindings: the type of each binding from 0 on.
  GpuPipeline make_compute(std::span<const std::uint32_t> shader,
                           std::span<const vk::DescriptorType> bindings, std::uint32_t push_size,
                           std::span<const GpuConstant> constants);
  struct Graphics {
    std::span<const std::uint32_t> vertex, fragment;
    std::span<const vk::DescriptorType> bindings;
    std::uint32_t push_size = 0;
    std::span<const GpuConstant> constants;  // of the fragment shader
    vk::Format colour = vk::Format::eUndefined;
    vk::Format depth = vk::Format::eUndefined;  // eUndefined: none
    std::span<const vk::VertexInputAttributeDescription> attributes = {};
    std::uint32_t vertex_stride = 0;  // 0: no vertex buffer
  };
  GpuPipeline make_graphics(const Graphics& of, const vk::raii::RenderPass& render_pass);
  // Clears colour (and depth), keeps the colour, leaves it ready to be copied from.
  vk::raii::RenderPass make_render_pass(vk::Format colour, vk::Format depth);

  GpuSet make_set(const GpuPipeline& pipeline, std::span<const GpuBinding> bindings);

  // Records, submits and waits.
  void submit(const std::function<void(const vk::raii::CommandBuffer&)>& record);

  // Copies through a host-visible buffer.
  void upload(const GpuBuffer& to, std::span<const std::byte> bytes, std::uint64_t offset = 0);
  void upload(const GpuImage& to, std::span<const std::byte> bytes, vk::ImageLayout layout);
  // Of an image in layout eTransferSrcOptimal.
  std::vector<std::byte> download(const GpuImage& from, std::uint32_t texel_bytes);

 private:
  struct Block {
    vk::raii::DeviceMemory memory = nullptr;
    std::uint64_t size = 0, used = 0;
    std::uint32_t type = 0;
    bool images = false;
    std::byte* mapped = nullptr;
  };
  struct Place {
    vk::DeviceMemory memory;
    std::uint64_t offset;
    std::byte* mapped;
  };
  VulkanDevice() = default;
  // The one host-visible buffer that copies go through.
  const GpuBuffer& staging(std::uint64_t size);
  Place allocate(const vk::MemoryRequirements& wants, bool host_visible, bool image);

  // In this order: what is declared first is destroyed last.
  std::shared_ptr<std::vector<std::string>> messages_ = std::make_shared<std::vector<std::string>>();
  std::unique_ptr<vk::raii::Context> context_;
  vk::raii::Instance instance_ = nullptr;
  vk::raii::DebugUtilsMessengerEXT messenger_ = nullptr;
  vk::raii::PhysicalDevice physical_ = nullptr;
  vk::raii::Device device_ = nullptr;
  vk::raii::Queue queue_ = nullptr;
  vk::raii::CommandPool pool_ = nullptr;
  vk::raii::PipelineCache cache_ = nullptr;
  std::vector<Block> blocks_;
  std::string name_;
  std::uint64_t uniform_alignment_ = 256;
  GpuBuffer staging_;
};

// A memory barrier between all that was recorded and all that follows.
void barrier(const vk::raii::CommandBuffer& commands);
// An image's change of layout, between all that was recorded and all that follows.
void change_layout(const vk::raii::CommandBuffer& commands, const GpuImage& image, vk::ImageLayout from,
                   vk::ImageLayout to);

// What body() gives; an exception of Vulkan as an error.
template <class Body>
auto vulkan_call(const Body& body) -> decltype(body()) {
  try {
    return body();
  } catch (const vk::Error& e) {
    return Error{Status::failed, std::string("Vulkan: ") + e.what(), "", 0};
  }
}

}  // namespace btfc
