// A C++ program that draws one frame with a btfc texture by Vulkan, of nothing but installed files: frame
// FILE.btfc OUT.ppm. Buffers lie where the host sees them; an engine would copy them to the device's own
// memory.
#include <btfc/btfc.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

namespace {

constexpr std::uint32_t kSide = 256;  // of the frame, pixels

struct Gpu {
  vk::raii::Context context;
  vk::raii::Instance instance = nullptr;
  vk::raii::PhysicalDevice physical = nullptr;
  vk::raii::Device device = nullptr;
  vk::raii::Queue queue = nullptr;
  vk::raii::CommandPool pool = nullptr;
};

struct Memory {
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::Buffer buffer = nullptr;
  unsigned char* bytes = nullptr;
};

std::uint32_t memory_type(const Gpu& gpu, std::uint32_t allowed, vk::MemoryPropertyFlags flags) {
  const auto memory = gpu.physical.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    if ((allowed >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
  }
  throw std::runtime_error("no memory of the kind that is needed");
}

Memory make_buffer(const Gpu& gpu, std::uint64_t size, vk::BufferUsageFlags usage) {
  Memory out;
  out.buffer = {gpu.device, vk::BufferCreateInfo({}, size, usage)};
  const auto wants = out.buffer.getMemoryRequirements();
  using Flag = vk::MemoryPropertyFlagBits;
  out.memory = {gpu.device,
                vk::MemoryAllocateInfo(wants.size, memory_type(gpu, wants.memoryTypeBits,
                                                               Flag::eHostVisible | Flag::eHostCoherent))};
  out.buffer.bindMemory(*out.memory, 0);
  out.bytes = static_cast<unsigned char*>(out.memory.mapMemory(0, VK_WHOLE_SIZE));
  return out;
}

template <class Record>
void submit(const Gpu& gpu, const Record& record) {
  const vk::raii::CommandBuffers buffers(
      gpu.device, vk::CommandBufferAllocateInfo(*gpu.pool, vk::CommandBufferLevel::ePrimary, 1));
  buffers[0].begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  record(buffers[0]);
  buffers[0].end();
  gpu.queue.submit(vk::SubmitInfo(0, nullptr, nullptr, 1, &*buffers[0]));
  gpu.queue.waitIdle();
}

// What a texture takes: four storage buffers and a uniform buffer in one descriptor set.
struct Bound {
  Memory words[BTFC_WORD_SLOTS], params, scratch;
  vk::raii::DescriptorSetLayout set_layout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::DescriptorPool pool = nullptr;
  vk::raii::DescriptorSet set = nullptr;
};

// [texture]
vk::raii::DescriptorSet make_set(const Gpu& gpu, Bound& bound, const Memory& slot3) {
  vk::raii::DescriptorSets sets(gpu.device, vk::DescriptorSetAllocateInfo(*bound.pool, *bound.set_layout));
  for (std::uint32_t i = 0; i <= BTFC_WORD_SLOTS; ++i) {
    const bool uniform = i == BTFC_WORD_SLOTS;
    const Memory& from = uniform ? bound.params : i == 3 ? slot3 : bound.words[i];
    const vk::DescriptorBufferInfo info(*from.buffer, 0, VK_WHOLE_SIZE);
    const auto type = uniform ? vk::DescriptorType::eUniformBuffer : vk::DescriptorType::eStorageBuffer;
    gpu.device.updateDescriptorSets(vk::WriteDescriptorSet(*sets[0], i, 0, 1, type, nullptr, &info), {});
  }
  return std::move(sets[0]);
}

void upload(const Gpu& gpu, const btfc_texture* texture, const btfc_gpu_plan_info& plan, Bound& bound) {
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
    bound.words[slot] = make_buffer(gpu, plan.words_size[slot], vk::BufferUsageFlagBits::eStorageBuffer);
    btfc_gpu_write_words(texture, slot, bound.words[slot].bytes, plan.words_size[slot]);
  }
  bound.params = make_buffer(gpu, sizeof plan.params[0], vk::BufferUsageFlagBits::eUniformBuffer);
  std::memcpy(bound.params.bytes, &plan.params[0], sizeof plan.params[0]);
  bound.set = make_set(gpu, bound, bound.words[3]);
}

// Of unbounded textures: what a window takes to be read from memory.
void prepare(const Gpu& gpu, const btfc_gpu_plan_info& plan, Bound& bound) {
  if (plan.pass_count == 0) return;
  bound.scratch = make_buffer(gpu, plan.scratch_size + 4, vk::BufferUsageFlagBits::eStorageBuffer);
  const vk::raii::DescriptorSet set = make_set(gpu, bound, bound.scratch);
  for (std::uint32_t i = 0; i < plan.pass_count; ++i) {
    const btfc_gpu_pass& pass = plan.passes[i];
    std::size_t size = 0;
    const std::uint32_t* code = btfc_gpu_shader(pass.shader, &size);
    const vk::raii::ShaderModule module(gpu.device, vk::ShaderModuleCreateInfo({}, size, code));
    const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main");
    const vk::raii::Pipeline pipeline(gpu.device, nullptr,
                                      vk::ComputePipelineCreateInfo({}, stage, *bound.layout));
    submit(gpu, [&](const vk::raii::CommandBuffer& commands) {  // waits, which is a barrier enough
      commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
      commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *bound.layout, 0, *set, {});
      commands.pushConstants<std::uint32_t>(*bound.layout, vk::ShaderStageFlagBits::eCompute, 0,
                                            {pass.push_size / 4, pass.push});
      commands.dispatch(pass.groups[0], pass.groups[1], pass.groups[2]);
    });
  }
}
// [texture]

Gpu open_gpu() {
  Gpu gpu;
  const vk::ApplicationInfo application("frame", 1, "frame", 1, VK_API_VERSION_1_1);
  gpu.instance = {gpu.context, vk::InstanceCreateInfo({}, &application)};
  gpu.physical = std::move(vk::raii::PhysicalDevices(gpu.instance).front());
  const float priority = 1;  // the first family of every device draws and computes
  const vk::DeviceQueueCreateInfo queue({}, 0, 1, &priority);
  gpu.device = {gpu.physical, vk::DeviceCreateInfo({}, queue)};
  gpu.queue = {gpu.device, 0, 0};
  gpu.pool = {gpu.device, vk::CommandPoolCreateInfo({}, 0)};
  return gpu;
}

void make_layouts(const Gpu& gpu, Bound& bound) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  const auto stages = vk::ShaderStageFlagBits::eFragment | vk::ShaderStageFlagBits::eCompute;
  for (std::uint32_t i = 0; i < BTFC_WORD_SLOTS; ++i)
    bindings.push_back({i, vk::DescriptorType::eStorageBuffer, 1, stages});
  bindings.push_back({BTFC_WORD_SLOTS, vk::DescriptorType::eUniformBuffer, 1, stages});
  bound.set_layout = {gpu.device, vk::DescriptorSetLayoutCreateInfo({}, bindings)};
  const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, 64);
  bound.layout = {gpu.device, vk::PipelineLayoutCreateInfo({}, 1, &*bound.set_layout, 1, &push)};
  const vk::DescriptorPoolSize sizes[] = {{vk::DescriptorType::eStorageBuffer, 2 * BTFC_WORD_SLOTS},
                                          {vk::DescriptorType::eUniformBuffer, 2}};
  bound.pool = {gpu.device,
                vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 2, sizes)};
}

vk::raii::RenderPass make_render_pass(const Gpu& gpu) {
  const vk::AttachmentDescription attachment(
      {}, vk::Format::eR8G8B8A8Unorm, vk::SampleCountFlagBits::e1, vk::AttachmentLoadOp::eClear,
      vk::AttachmentStoreOp::eStore, vk::AttachmentLoadOp::eDontCare, vk::AttachmentStoreOp::eDontCare,
      vk::ImageLayout::eUndefined, vk::ImageLayout::eTransferSrcOptimal);
  const vk::AttachmentReference reference(0, vk::ImageLayout::eColorAttachmentOptimal);
  const vk::SubpassDescription subpass({}, vk::PipelineBindPoint::eGraphics, {}, reference);
  const vk::SubpassDependency after(0, VK_SUBPASS_EXTERNAL, vk::PipelineStageFlagBits::eColorAttachmentOutput,
                                    vk::PipelineStageFlagBits::eTransfer,
                                    vk::AccessFlagBits::eColorAttachmentWrite,
                                    vk::AccessFlagBits::eTransferRead);
  return {gpu.device, vk::RenderPassCreateInfo({}, attachment, subpass, after)};
}

vk::raii::Pipeline make_pipeline(const Gpu& gpu, const Bound& bound, const vk::raii::RenderPass& render_pass,
                                 const std::uint32_t (&constants)[2],
                                 const std::vector<std::uint32_t>& fragment_code) {
  std::size_t size = 0;
  const std::uint32_t* code = btfc_gpu_shader("btfc_full.vert", &size);
  const vk::raii::ShaderModule vertex(gpu.device, vk::ShaderModuleCreateInfo({}, size, code));
  const vk::raii::ShaderModule fragment(gpu.device, vk::ShaderModuleCreateInfo({}, fragment_code));
  const vk::SpecializationMapEntry entries[] = {{0, 0, 4}, {3, 4, 4}};  // the model; the map's channels
  const vk::SpecializationInfo special(2, entries, sizeof constants, constants);
  const vk::PipelineShaderStageCreateInfo stages[] = {
      {{}, vk::ShaderStageFlagBits::eVertex, *vertex, "main"},
      {{}, vk::ShaderStageFlagBits::eFragment, *fragment, "main", &special}};
  const vk::PipelineVertexInputStateCreateInfo input;
  const vk::PipelineInputAssemblyStateCreateInfo assembly({}, vk::PrimitiveTopology::eTriangleList);
  const vk::Viewport area(0, 0, kSide, kSide, 0, 1);
  const vk::Rect2D scissor({0, 0}, {kSide, kSide});
  const vk::PipelineViewportStateCreateInfo viewport({}, area, scissor);
  vk::PipelineRasterizationStateCreateInfo raster;
  raster.lineWidth = 1;
  const vk::PipelineMultisampleStateCreateInfo samples;
  vk::PipelineColorBlendAttachmentState blend;
  blend.colorWriteMask = vk::ColorComponentFlags(vk::FlagTraits<vk::ColorComponentFlagBits>::allFlags);
  const vk::PipelineColorBlendStateCreateInfo blending({}, false, vk::LogicOp::eCopy, blend);
  return {gpu.device, nullptr,
          vk::GraphicsPipelineCreateInfo({}, stages, &input, &assembly, nullptr, &viewport, &raster, &samples,
                                         nullptr, &blending, nullptr, *bound.layout, *render_pass)};
}

void draw(const Gpu& gpu, const Bound& bound, const std::uint32_t (&constants)[2],
          const std::vector<std::uint32_t>& fragment_code, const char* path) {
  using Usage = vk::ImageUsageFlagBits;
  const vk::raii::Image image(
      gpu.device, vk::ImageCreateInfo({}, vk::ImageType::e2D, vk::Format::eR8G8B8A8Unorm, {kSide, kSide, 1},
                                      1, 1, vk::SampleCountFlagBits::e1, vk::ImageTiling::eOptimal,
                                      Usage::eColorAttachment | Usage::eTransferSrc));
  const auto wants = image.getMemoryRequirements();
  const vk::raii::DeviceMemory memory(
      gpu.device, vk::MemoryAllocateInfo(wants.size, memory_type(gpu, wants.memoryTypeBits, {})));
  image.bindMemory(*memory, 0);
  const vk::ImageSubresourceRange whole(vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1);
  const vk::raii::ImageView view(gpu.device, vk::ImageViewCreateInfo({}, *image, vk::ImageViewType::e2D,
                                                                     vk::Format::eR8G8B8A8Unorm, {}, whole));
  const vk::raii::RenderPass render_pass = make_render_pass(gpu);
  const vk::raii::Framebuffer target(gpu.device,
                                     vk::FramebufferCreateInfo({}, *render_pass, 1, &*view, kSide, kSide, 1));
  const vk::raii::Pipeline pipeline = make_pipeline(gpu, bound, render_pass, constants, fragment_code);
  const Memory pixels = make_buffer(gpu, 4 * kSide * kSide, vk::BufferUsageFlagBits::eTransferDst);
  submit(gpu, [&](const vk::raii::CommandBuffer& commands) {
    const vk::ClearValue clear;
    commands.beginRenderPass(
        vk::RenderPassBeginInfo(*render_pass, *target, vk::Rect2D({0, 0}, {kSide, kSide}), clear),
        vk::SubpassContents::eInline);
    commands.bindPipeline(vk::PipelineBindPoint::eGraphics, *pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eGraphics, *bound.layout, 0, *bound.set, {});
    commands.draw(3, 1, 0, 0);
    commands.endRenderPass();
    const vk::BufferImageCopy copy(0, 0, 0, {vk::ImageAspectFlagBits::eColor, 0, 0, 1}, {0, 0, 0},
                                   {kSide, kSide, 1});
    commands.copyImageToBuffer(*image, vk::ImageLayout::eTransferSrcOptimal, *pixels.buffer, copy);
  });
  std::ofstream out(path, std::ios::binary);
  out << "P6\n" << kSide << ' ' << kSide << "\n255\n";
  for (std::uint32_t i = 0; i < kSide * kSide; ++i)
    out.write(reinterpret_cast<const char*>(&pixels.bytes[4 * i]), 3);
  unsigned sum = 0;
  for (std::uint32_t i = 0; i < 4 * kSide * kSide; ++i) sum += pixels.bytes[i];
  std::printf("frame: %ux%u by %s, mean %.1f\n", kSide, kSide, gpu.physical.getProperties().deviceName.data(),
              sum / (4.0 * kSide * kSide));
}

std::vector<char> read_file(const char* path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

int run(const char* file, const char* out) {
  const std::vector<char> bytes = read_file(file), spirv = read_file(BTFC_FRAME_SPIRV);
  const btfc::Texture texture =
      btfc::Texture::load({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
  if (!texture) {
    std::fprintf(stderr, "frame: %s\n", texture.error().message);
    return 1;
  }
  std::vector<std::uint32_t> fragment(spirv.size() / 4);
  std::memcpy(fragment.data(), spirv.data(), 4 * fragment.size());

  const btfc_gpu_window window{-512, -512, 1024, 1024};  // of unbounded textures; others ignore it
  btfc_gpu_plan* plan = nullptr;
  btfc_error error;
  if (btfc_gpu_plan_new(texture.get(), &window, &plan, &error) != BTFC_OK) {
    std::fprintf(stderr, "frame: %s\n", error.message);
    return 1;
  }
  const btfc_gpu_plan_info& info = *btfc_gpu_plan_get(plan);
  const Gpu gpu = open_gpu();
  Bound bound;
  make_layouts(gpu, bound);
  upload(gpu, texture.get(), info, bound);
  prepare(gpu, info, bound);
  draw(gpu, bound, {info.model, texture.map(0).channels}, fragment, out);
  btfc_gpu_plan_free(plan);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  try {
    return run(argv[1], argv[2]);
  } catch (const std::exception& e) {  // no Vulkan here
    std::fprintf(stderr, "frame: %s\n", e.what());
    return 5;
  }
}
