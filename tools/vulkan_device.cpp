// Instance, device, memory and pipelines.
#include "tools/vulkan_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace btfc {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr std::uint64_t kBlockBytes = std::uint64_t{32} << 20, kStagingBytes = std::uint64_t{8} << 20;

// What the layer says of being switched on: that VK_EXT_debug_utils is for debugging.
constexpr const char* kOfTheLayerItself =
    "UNASSIGNED-BestPractices-vkCreateInstance-specialuse-extension-debugging";

VKAPI_ATTR VkBool32 VKAPI_CALL take_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  const std::string id = data->pMessageIdName != nullptr ? data->pMessageIdName : "";
  if (id != kOfTheLayerItself)
    static_cast<std::vector<std::string>*>(user)->push_back(id + ": " + data->pMessage);
  return VK_FALSE;
}

vk::DebugUtilsMessengerCreateInfoEXT messenger_info(std::vector<std::string>* messages) {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  return {{},
          Severity::eWarning | Severity::eError,
          Type::eValidation | Type::ePerformance,
          take_message,
          messages};
}

std::optional<std::uint32_t> queue_family(const vk::raii::PhysicalDevice& device) {
  const auto families = device.getQueueFamilyProperties();
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    const vk::QueueFlags both = vk::QueueFlagBits::eGraphics | vk::QueueFlagBits::eCompute;
    if ((families[i].queueFlags & both) == both) return i;
  }
  return std::nullopt;
}

VulkanFacts facts_of(const vk::raii::PhysicalDevice& device) {
  const vk::PhysicalDeviceProperties p = device.getProperties();
  const vk::FormatProperties format = device.getFormatProperties(vk::Format::eR32G32B32A32Sfloat);
  const vk::FormatFeatureFlags target =
      vk::FormatFeatureFlagBits::eStorageImage | vk::FormatFeatureFlagBits::eColorAttachment;
  VulkanFacts facts;
  facts.name = p.deviceName.data();
  facts.version = p.apiVersion;
  facts.graphics_and_compute = queue_family(device).has_value();
  facts.storage_bytes = p.limits.maxStorageBufferRange;
  facts.storage_buffers = p.limits.maxPerStageDescriptorStorageBuffers;
  facts.push_bytes = p.limits.maxPushConstantsSize;
  facts.image_side = p.limits.maxImageDimension2D;
  facts.float_target = (format.optimalTilingFeatures & target) == target;
  return facts;
}

int preference(vk::PhysicalDeviceType type) {
  if (type == vk::PhysicalDeviceType::eDiscreteGpu) return 0;
  if (type == vk::PhysicalDeviceType::eIntegratedGpu) return 1;
  return type == vk::PhysicalDeviceType::eVirtualGpu ? 2 : 3;
}

vk::raii::ShaderModule module_of(const vk::raii::Device& device, std::span<const std::uint32_t> shader) {
  return {device, vk::ShaderModuleCreateInfo({}, shader.size_bytes(), shader.data())};
}

// Specialisation constants as Vulkan wants them.
struct Specialisation {
  explicit Specialisation(std::span<const GpuConstant> constants) {
    for (const GpuConstant& constant : constants) {
      entries.push_back({constant.id, static_cast<std::uint32_t>(values.size() * 4), 4});
      values.push_back(constant.value);
    }
    info = vk::SpecializationInfo(static_cast<std::uint32_t>(entries.size()), entries.data(),
                                  values.size() * 4, values.data());
  }
  std::vector<vk::SpecializationMapEntry> entries;
  std::vector<std::uint32_t> values;
  vk::SpecializationInfo info;
};

vk::BufferImageCopy whole(const GpuImage& image) {
  return {0, 0, 0, {vk::ImageAspectFlagBits::eColor, 0, 0, 1}, {0, 0, 0}, {image.width, image.height, 1}};
}

void make_layouts(const vk::raii::Device& device, std::span<const vk::DescriptorType> types,
                  std::uint32_t push_size, GpuPipeline& pipeline) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  for (std::uint32_t i = 0; i < types.size(); ++i) bindings.push_back({i, types[i], 1, pipeline.stages});
  pipeline.set_layout = {device, vk::DescriptorSetLayoutCreateInfo({}, bindings)};
  const vk::PushConstantRange push(pipeline.stages, 0, push_size);
  pipeline.layout = {
      device, vk::PipelineLayoutCreateInfo({}, 1, &*pipeline.set_layout, push_size > 0 ? 1 : 0, &push)};
}

}  // namespace

Result<std::unique_ptr<VulkanDevice>> VulkanDevice::open(const VulkanNeeds& needs, bool validation) {
  const auto none = [](const std::string& why) { return unsupported("", 0, "no Vulkan device: " + why); };
  std::unique_ptr<VulkanDevice> out(new VulkanDevice);
  try {
    out->context_ = std::make_unique<vk::raii::Context>();
    if (out->context_->enumerateInstanceVersion() < VK_API_VERSION_1_1)
      return none("the loader knows Vulkan 1.0 alone, expected 1.1 or later");
    std::vector<const char*> layers, extensions;
    const vk::ValidationFeatureEnableEXT checks[] = {
        vk::ValidationFeatureEnableEXT::eBestPractices,
        vk::ValidationFeatureEnableEXT::eSynchronizationValidation};
    auto messenger = messenger_info(out->messages_.get());
    const vk::ValidationFeaturesEXT features(checks, {}, &messenger);
    if (validation) {
      const auto known = out->context_->enumerateInstanceLayerProperties();
      const auto is_it = [](const vk::LayerProperties& l) {
        return std::strcmp(l.layerName.data(), kValidationLayer) == 0;
      };
      if (std::none_of(known.begin(), known.end(), is_it))
        return unsupported("", 0, fmt::format("the Vulkan layer {} is not installed", kValidationLayer));
      layers.push_back(kValidationLayer);
      extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    }
    const vk::ApplicationInfo application("btfc", 1, "btfc", 1, VK_API_VERSION_1_1);
    out->instance_ = {*out->context_, vk::InstanceCreateInfo({}, &application, layers, extensions,
                                                             validation ? &features : nullptr)};
    if (validation) out->messenger_ = {out->instance_, messenger_info(out->messages_.get())};

    vk::raii::PhysicalDevices all(out->instance_);
    if (all.empty()) return none("no driver is installed");
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return preference(a.getProperties().deviceType) < preference(b.getProperties().deviceType);
    });
    std::string lacking;
    for (vk::raii::PhysicalDevice& one : all) {
      const VulkanFacts facts = facts_of(one);
      if (const auto missing = missing_for(facts, needs)) {
        lacking += fmt::format("{}'{}' does not do: {}", lacking.empty() ? "" : "; ", facts.name, *missing);
        continue;
      }
      out->name_ = facts.name;
      out->physical_ = std::move(one);
      break;
    }
    if (out->name_.empty()) return none(lacking);
    const std::uint32_t family = *queue_family(out->physical_);
    const float priority = 1;
    const vk::DeviceQueueCreateInfo queue({}, family, 1, &priority);
    out->device_ = {out->physical_, vk::DeviceCreateInfo({}, queue)};
    out->queue_ = {out->device_, family, 0};
    out->pool_ = {out->device_, vk::CommandPoolCreateInfo({}, family)};
    out->cache_ = {out->device_, vk::PipelineCacheCreateInfo()};
    out->uniform_alignment_ = out->physical_.getProperties().limits.minUniformBufferOffsetAlignment;
  } catch (const vk::Error& e) {
    return none(e.what());
  } catch (const std::runtime_error& e) {  // the loader's library is not there
    return none(e.what());
  }
  return out;
}

VulkanDevice::Place VulkanDevice::allocate(const vk::MemoryRequirements& wants, bool host_visible,
                                           bool image) {
  const auto memory = physical_.getMemoryProperties();
  const vk::MemoryPropertyFlags flags =
      host_visible ? vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent
                   : vk::MemoryPropertyFlags(vk::MemoryPropertyFlagBits::eDeviceLocal);
  std::uint32_t type = memory.memoryTypeCount;
  for (std::uint32_t i = memory.memoryTypeCount; i-- > 0;) {
    if ((wants.memoryTypeBits >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags)
      type = i;
  }
  if (type == memory.memoryTypeCount)
    throw vk::FeatureNotPresentError("no memory of the kind that is needed");
  // Buffers and images lie apart, so that they need not keep the granularity between the two.
  Block* found = nullptr;
  std::uint64_t offset = 0;
  for (Block& block : blocks_) {
    const std::uint64_t at = (block.used + wants.alignment - 1) / wants.alignment * wants.alignment;
    if (block.type != type || block.images != image || at + wants.size > block.size) continue;
    found = &block;
    offset = at;
  }
  if (found == nullptr) {
    Block block;
    block.size = std::max(kBlockBytes, wants.size);
    block.type = type;
    block.images = image;
    block.memory = {device_, vk::MemoryAllocateInfo(block.size, type)};
    if (memory.memoryTypes[type].propertyFlags & vk::MemoryPropertyFlagBits::eHostVisible)
      block.mapped = static_cast<std::byte*>(block.memory.mapMemory(0, VK_WHOLE_SIZE));
    found = &blocks_.emplace_back(std::move(block));
  }
  found->used = offset + wants.size;
  return {*found->memory, offset, found->mapped != nullptr ? found->mapped + offset : nullptr};
}

GpuBuffer VulkanDevice::make_buffer(std::uint64_t size, vk::BufferUsageFlags usage, bool host_visible) {
  GpuBuffer out;
  out.size = size;
  out.buffer = {device_, vk::BufferCreateInfo({}, size,
                                              usage | vk::BufferUsageFlagBits::eTransferDst |
                                                  vk::BufferUsageFlagBits::eTransferSrc)};
  const Place place = allocate(out.buffer.getMemoryRequirements(), host_visible, false);
  out.buffer.bindMemory(place.memory, place.offset);
  out.mapped = place.mapped;
  return out;
}

GpuImage VulkanDevice::make_image(std::uint32_t width, std::uint32_t height, vk::Format format,
                                  vk::ImageUsageFlags usage, vk::ImageAspectFlags aspect) {
  GpuImage out;
  out.width = width;
  out.height = height;
  out.format = format;
  out.image = {device_, vk::ImageCreateInfo({}, vk::ImageType::e2D, format, {width, height, 1}, 1, 1,
                                            vk::SampleCountFlagBits::e1, vk::ImageTiling::eOptimal, usage)};
  const Place place = allocate(out.image.getMemoryRequirements(), false, true);
  out.image.bindMemory(place.memory, place.offset);
  out.view = {device_, vk::ImageViewCreateInfo({}, *out.image, vk::ImageViewType::e2D, format, {},
                                               {aspect, 0, 1, 0, 1})};
  return out;
}

GpuPipeline VulkanDevice::make_compute(std::span<const std::uint32_t> shader,
                                       std::span<const vk::DescriptorType> bindings, std::uint32_t push_size,
                                       std::span<const GpuConstant> constants) {
  GpuPipeline out;
  out.stages = vk::ShaderStageFlagBits::eCompute;
  make_layouts(device_, bindings, push_size, out);
  const vk::raii::ShaderModule module = module_of(device_, shader);
  const Specialisation special(constants);
  const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main",
                                                &special.info);
  out.pipeline = {device_, cache_, vk::ComputePipelineCreateInfo({}, stage, *out.layout)};
  return out;
}

vk::raii::RenderPass VulkanDevice::make_render_pass(vk::Format colour, vk::Format depth) {
  const bool has_depth = depth != vk::Format::eUndefined;
  const vk::AttachmentDescription attachments[] = {{{},
                                                    colour,
                                                    vk::SampleCountFlagBits::e1,
                                                    vk::AttachmentLoadOp::eClear,
                                                    vk::AttachmentStoreOp::eStore,
                                                    vk::AttachmentLoadOp::eDontCare,
                                                    vk::AttachmentStoreOp::eDontCare,
                                                    vk::ImageLayout::eUndefined,
                                                    vk::ImageLayout::eTransferSrcOptimal},
                                                   {{},
                                                    depth,
                                                    vk::SampleCountFlagBits::e1,
                                                    vk::AttachmentLoadOp::eClear,
                                                    vk::AttachmentStoreOp::eDontCare,
                                                    vk::AttachmentLoadOp::eDontCare,
                                                    vk::AttachmentStoreOp::eDontCare,
                                                    vk::ImageLayout::eUndefined,
                                                    vk::ImageLayout::eDepthStencilAttachmentOptimal}};
  const vk::AttachmentReference colour_reference(0, vk::ImageLayout::eColorAttachmentOptimal);
  const vk::AttachmentReference depth_reference(1, vk::ImageLayout::eDepthStencilAttachmentOptimal);
  vk::SubpassDescription subpass({}, vk::PipelineBindPoint::eGraphics, {}, colour_reference);
  if (has_depth) subpass.setPDepthStencilAttachment(&depth_reference);
  using Stage = vk::PipelineStageFlagBits;
  using Access = vk::AccessFlagBits;
  const vk::PipelineStageFlags drawing =
      Stage::eColorAttachmentOutput | Stage::eEarlyFragmentTests | Stage::eLateFragmentTests;
  const vk::AccessFlags targets = Access::eColorAttachmentWrite | Access::eDepthStencilAttachmentWrite |
                                  Access::eDepthStencilAttachmentRead;
  // What came before is done with the attachments, and what follows may copy from them.
  const vk::SubpassDependency dependencies[] = {
      {VK_SUBPASS_EXTERNAL, 0, Stage::eTransfer | drawing, drawing, targets | Access::eTransferRead, targets},
      {0, VK_SUBPASS_EXTERNAL, drawing, Stage::eTransfer, targets, Access::eTransferRead}};
  return {device_,
          vk::RenderPassCreateInfo({}, has_depth ? 2u : 1u, attachments, 1, &subpass, 2, dependencies)};
}

GpuPipeline VulkanDevice::make_graphics(const Graphics& of, const vk::raii::RenderPass& render_pass) {
  GpuPipeline out;
  out.stages = vk::ShaderStageFlagBits::eVertex | vk::ShaderStageFlagBits::eFragment;
  make_layouts(device_, of.bindings, of.push_size, out);
  const vk::raii::ShaderModule vertex = module_of(device_, of.vertex),
                               fragment = module_of(device_, of.fragment);
  const Specialisation special(of.constants);
  const vk::PipelineShaderStageCreateInfo stages[] = {
      {{}, vk::ShaderStageFlagBits::eVertex, *vertex, "main"},
      {{}, vk::ShaderStageFlagBits::eFragment, *fragment, "main", &special.info}};
  const vk::VertexInputBindingDescription binding(0, of.vertex_stride, vk::VertexInputRate::eVertex);
  const vk::PipelineVertexInputStateCreateInfo input({}, of.vertex_stride > 0 ? 1u : 0u, &binding,
                                                     static_cast<std::uint32_t>(of.attributes.size()),
                                                     of.attributes.data());
  const vk::PipelineInputAssemblyStateCreateInfo assembly({}, vk::PrimitiveTopology::eTriangleList);
  const vk::PipelineViewportStateCreateInfo viewport({}, 1, nullptr, 1, nullptr);
  const vk::PipelineRasterizationStateCreateInfo raster({}, false, false, vk::PolygonMode::eFill,
                                                        vk::CullModeFlagBits::eNone,
                                                        vk::FrontFace::eCounterClockwise, false, 0, 0, 0, 1);
  const vk::PipelineMultisampleStateCreateInfo samples;
  const bool has_depth = of.depth != vk::Format::eUndefined;
  const vk::PipelineDepthStencilStateCreateInfo depth({}, has_depth, has_depth, vk::CompareOp::eLess);
  vk::PipelineColorBlendAttachmentState blend;
  using Part = vk::ColorComponentFlagBits;
  blend.colorWriteMask = Part::eR | Part::eG | Part::eB | Part::eA;
  const vk::PipelineColorBlendStateCreateInfo blending({}, false, vk::LogicOp::eCopy, blend);
  const vk::DynamicState dynamic[] = {vk::DynamicState::eViewport, vk::DynamicState::eScissor};
  const vk::PipelineDynamicStateCreateInfo dynamics({}, dynamic);
  const vk::GraphicsPipelineCreateInfo info({}, stages, &input, &assembly, nullptr, &viewport, &raster,
                                            &samples, &depth, &blending, &dynamics, *out.layout,
                                            *render_pass);
  out.pipeline = {device_, cache_, info};
  return out;
}

GpuSet VulkanDevice::make_set(const GpuPipeline& pipeline, std::span<const GpuBinding> bindings) {
  GpuSet out;
  std::vector<vk::DescriptorPoolSize> sizes;
  for (const GpuBinding& binding : bindings) sizes.push_back({binding.type, 1});
  out.pool = {device_,
              vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, sizes)};
  out.set = std::move(
      vk::raii::DescriptorSets(device_, vk::DescriptorSetAllocateInfo(*out.pool, *pipeline.set_layout))
          .front());
  std::vector<vk::DescriptorBufferInfo> buffers(bindings.size());
  std::vector<vk::DescriptorImageInfo> images(bindings.size());
  std::vector<vk::WriteDescriptorSet> writes;
  for (std::uint32_t i = 0; i < bindings.size(); ++i) {
    const GpuBinding& b = bindings[i];
    if (b.buffer != nullptr) {
      buffers[i] = vk::DescriptorBufferInfo(*b.buffer->buffer, b.offset, b.range);
    } else {
      const bool sampled = b.type == vk::DescriptorType::eCombinedImageSampler;
      images[i] = vk::DescriptorImageInfo(
          b.sampler, *b.image->view,
          sampled ? vk::ImageLayout::eShaderReadOnlyOptimal : vk::ImageLayout::eGeneral);
    }
    writes.push_back({*out.set, i, 0, 1, b.type, b.buffer != nullptr ? nullptr : &images[i],
                      b.buffer != nullptr ? &buffers[i] : nullptr});
  }
  device_.updateDescriptorSets(writes, {});
  return out;
}

void VulkanDevice::submit(const std::function<void(const vk::raii::CommandBuffer&)>& record) {
  const vk::raii::CommandBuffers made(
      device_, vk::CommandBufferAllocateInfo(*pool_, vk::CommandBufferLevel::ePrimary, 1));
  const vk::raii::CommandBuffer& commands = made.front();
  commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  record(commands);
  commands.end();
  const vk::raii::Fence fence(device_, vk::FenceCreateInfo());
  queue_.submit(vk::SubmitInfo(0, nullptr, nullptr, 1, &*commands), *fence);
  if (device_.waitForFences(*fence, true, UINT64_MAX) != vk::Result::eSuccess)
    throw vk::DeviceLostError("a submission did not end");
}

const GpuBuffer& VulkanDevice::staging(std::uint64_t size) {
  if (staging_.size < size) staging_ = make_buffer(std::max(size, kStagingBytes), {}, true);
  return staging_;
}

void VulkanDevice::upload(const GpuBuffer& to, std::span<const std::byte> bytes, std::uint64_t offset) {
  for (std::size_t done = 0; done < bytes.size(); done += kStagingBytes) {
    const std::size_t now = std::min<std::size_t>(kStagingBytes, bytes.size() - done);
    const GpuBuffer& from = staging(kStagingBytes);
    std::memcpy(from.mapped, bytes.data() + done, now);
    submit([&](const vk::raii::CommandBuffer& commands) {
      commands.copyBuffer(*from.buffer, *to.buffer, vk::BufferCopy(0, offset + done, now));
      barrier(commands);
    });
  }
}

void VulkanDevice::upload(const GpuImage& to, std::span<const std::byte> bytes, vk::ImageLayout layout) {
  const GpuBuffer& from = staging(bytes.size());
  std::memcpy(from.mapped, bytes.data(), bytes.size());
  submit([&](const vk::raii::CommandBuffer& commands) {
    change_layout(commands, to, vk::ImageLayout::eUndefined, vk::ImageLayout::eTransferDstOptimal);
    commands.copyBufferToImage(*from.buffer, *to.image, vk::ImageLayout::eTransferDstOptimal, whole(to));
    change_layout(commands, to, vk::ImageLayout::eTransferDstOptimal, layout);
  });
}

std::vector<std::byte> VulkanDevice::download(const GpuImage& from, std::uint32_t texel_bytes) {
  const std::uint64_t size = std::uint64_t{from.width} * from.height * texel_bytes;
  const GpuBuffer& to = staging(size);
  submit([&](const vk::raii::CommandBuffer& commands) {
    commands.copyImageToBuffer(*from.image, vk::ImageLayout::eTransferSrcOptimal, *to.buffer, whole(from));
    barrier(commands);
  });
  return {to.mapped, to.mapped + size};
}

namespace {

constexpr vk::PipelineStageFlags kUsedStages =
    vk::PipelineStageFlagBits::eComputeShader | vk::PipelineStageFlagBits::eFragmentShader |
    vk::PipelineStageFlagBits::eTransfer | vk::PipelineStageFlagBits::eHost |
    vk::PipelineStageFlagBits::eVertexInput | vk::PipelineStageFlagBits::eColorAttachmentOutput;
constexpr vk::AccessFlags kWrites = vk::AccessFlagBits::eShaderWrite | vk::AccessFlagBits::eTransferWrite |
                                    vk::AccessFlagBits::eColorAttachmentWrite;
constexpr vk::AccessFlags kReads = vk::AccessFlagBits::eShaderRead | vk::AccessFlagBits::eShaderWrite |
                                   vk::AccessFlagBits::eTransferRead | vk::AccessFlagBits::eTransferWrite |
                                   vk::AccessFlagBits::eHostRead | vk::AccessFlagBits::eUniformRead |
                                   vk::AccessFlagBits::eVertexAttributeRead | vk::AccessFlagBits::eIndexRead |
                                   vk::AccessFlagBits::eColorAttachmentWrite;

// What is done to an image in a layout.
vk::AccessFlags access_of(vk::ImageLayout layout) {
  using Access = vk::AccessFlagBits;
  if (layout == vk::ImageLayout::eTransferDstOptimal) return Access::eTransferWrite;
  if (layout == vk::ImageLayout::eTransferSrcOptimal) return Access::eTransferRead;
  if (layout == vk::ImageLayout::eShaderReadOnlyOptimal) return Access::eShaderRead;
  if (layout == vk::ImageLayout::eGeneral) return Access::eShaderRead | Access::eShaderWrite;
  return {};
}

}  // namespace

void barrier(const vk::raii::CommandBuffer& commands) {
  commands.pipelineBarrier(kUsedStages, kUsedStages, {}, vk::MemoryBarrier(kWrites, kReads), {}, {});
}

void change_layout(const vk::raii::CommandBuffer& commands, const GpuImage& image, vk::ImageLayout from,
                   vk::ImageLayout to) {
  const vk::ImageMemoryBarrier change(access_of(from), access_of(to), from, to, VK_QUEUE_FAMILY_IGNORED,
                                      VK_QUEUE_FAMILY_IGNORED, *image.image,
                                      {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1});
  commands.pipelineBarrier(kUsedStages, kUsedStages, {}, {}, {}, change);
}

}  // namespace btfc
