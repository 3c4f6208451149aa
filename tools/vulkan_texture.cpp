// Uploads, passes and pipelines of one texture.
#include "tools/vulkan_texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "tools/texture_file.h"

namespace btfc {
namespace {

using Type = vk::DescriptorType;
constexpr Type kStorage = Type::eStorageBuffer;
constexpr Type kTextureTypes[] = {kStorage, kStorage, kStorage, kStorage, Type::eUniformBuffer};
constexpr vk::Format kValues = vk::Format::eR32G32B32A32Sfloat;
constexpr std::uint32_t kGroup = 8;  // invocations a side of a workgroup
constexpr std::uint32_t kModelConstant = 0, kRobustConstant = 1, kFilterConstant = 2, kParamConstant = 16;
constexpr std::uint32_t kFetchesConstant = 3, kTexelsConstant = 4;  // of btfc_bench.comp

std::vector<Type> types_with(std::initializer_list<Type> more) {
  std::vector<Type> types(std::begin(kTextureTypes), std::end(kTextureTypes));
  types.insert(types.end(), more);
  return types;
}

std::uint32_t groups_for(std::uint32_t invocations) { return (invocations + kGroup - 1) / kGroup; }

struct PlanFree {
  void operator()(btfc_gpu_plan* plan) const { btfc_gpu_plan_free(plan); }
};

template <class Push>
void push_constants(const vk::raii::CommandBuffer& commands, const GpuPipeline& pipeline, const Push& push) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&push);
  commands.pushConstants<std::uint8_t>(*pipeline.layout, pipeline.stages, 0, {sizeof push, bytes});
}

void dispatch(const vk::raii::CommandBuffer& commands, const GpuPipeline& pipeline, const GpuSet& set,
              std::uint32_t width, std::uint32_t height) {
  commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline.pipeline);
  commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *pipeline.layout, 0, *set.set, {});
  commands.dispatch(groups_for(width), groups_for(height), 1);
}

std::vector<float> floats_of(const std::vector<std::byte>& bytes) {
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

namespace {

using Plan = std::unique_ptr<btfc_gpu_plan, PlanFree>;

Result<Plan> plan_for(const btfc_texture* texture, const btfc_gpu_window* window) {
  btfc_gpu_plan* made = nullptr;
  btfc_error error;
  if (btfc_gpu_plan_new(texture, window, &made, &error) != BTFC_OK) return from_api(error);
  return Plan(made);
}

}  // namespace

Result<ShaderData> shader_data(const btfc_texture* texture) {
  const Result<Plan> plan = plan_for(texture, nullptr);
  if (!plan) return plan.error();
  const btfc_gpu_plan_info& info = *btfc_gpu_plan_get(plan->get());
  ShaderData data;
  data.model = info.model;
  data.params.assign(info.params, info.params + info.map_count);
  data.fixed_params = info.fixed_params;
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
    data.words[slot].resize(info.words_upload[slot] / 4);
    btfc_gpu_write_words(texture, slot, data.words[slot].data(), info.words_upload[slot]);
  }
  return data;
}

VulkanTexture::VulkanTexture(std::unique_ptr<VulkanDevice> device, const ShaderData& data,
                             const btfc_texture* texture, const VulkanOptions& options)
    : device_(std::move(device)),
      texture_(texture),
      options_(options),
      model_(data.model),
      fixed_params_(data.fixed_params) {
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
    const auto bytes = std::as_bytes(std::span(data.words[slot]));
    words_[slot] = device_->make_buffer(std::max<std::uint64_t>(bytes.size(), 4),
                                        vk::BufferUsageFlagBits::eStorageBuffer);
    device_->upload(words_[slot], bytes);
  }
  const std::uint64_t alignment = device_->uniform_alignment();
  uniform_stride_ = (sizeof(btfc_gpu_params) + alignment - 1) / alignment * alignment;
  uniforms_ =
      device_->make_buffer(uniform_stride_ * data.params.size(), vk::BufferUsageFlagBits::eUniformBuffer);
  write_params(data.params);
}

void VulkanTexture::write_params(std::span<const btfc_gpu_params> params) {
  params_.assign(params.begin(), params.end());
  for (std::size_t map = 0; map < params_.size(); ++map)
    device_->upload(uniforms_, std::as_bytes(std::span(&params_[map], 1)), map * uniform_stride_);
}

Result<Done> VulkanTexture::prepare(const btfc_gpu_window& window) {
  if (texture_ == nullptr) return Done{};
  const Result<Plan> plan = plan_for(texture_, &window);
  if (!plan) return plan.error();
  const btfc_gpu_plan_info& info = *btfc_gpu_plan_get(plan->get());
  for (std::uint32_t i = 0; i < info.pass_count; ++i) {
    if (const auto found = general_shader(info.passes[i].shader); !found) return found.error();
  }
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
    if (info.words_size[slot] > words_[slot].size)
      words_[slot] = device_->make_buffer(info.words_size[slot], vk::BufferUsageFlagBits::eStorageBuffer);
  }
  write_params({info.params, info.map_count});
  if (info.pass_count > 0) run({info.passes, info.pass_count}, info.scratch_size);
  return Done{};
}

void VulkanTexture::run(std::span<const btfc_gpu_pass> passes, std::uint64_t scratch_size) {
  if (scratch_.size < std::max<std::uint64_t>(scratch_size, 4)) {
    scratch_ = device_->make_buffer(std::max<std::uint64_t>(scratch_size, 4),
                                    vk::BufferUsageFlagBits::eStorageBuffer);
  }
  std::vector<GpuBinding> bound = bindings(0);
  bound[3] = {kStorage, &scratch_};
  std::map<std::string, GpuSet> sets;
  for (const btfc_gpu_pass& pass : passes) {
    const auto [at, fresh] = passes_.try_emplace(pass.shader);
    if (fresh)
      at->second = device_->make_compute(*general_shader(pass.shader), kTextureTypes, pass.push_size, {});
    if (sets.count(pass.shader) == 0) sets[pass.shader] = device_->make_set(at->second, bound);
  }
  // A submission each: a device that ends what takes too long measures these.
  for (const btfc_gpu_pass& pass : passes) {
    device_->submit([&](const vk::raii::CommandBuffer& commands) {
      const GpuPipeline& pipeline = passes_.at(pass.shader);
      commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline.pipeline);
      commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *pipeline.layout, 0,
                                  *sets[pass.shader].set, {});
      commands.pushConstants<std::uint32_t>(*pipeline.layout, pipeline.stages, 0,
                                            {pass.push_size / 4, pass.push});
      commands.dispatch(pass.groups[0], pass.groups[1], pass.groups[2]);
      barrier(commands);
    });
  }
}

std::vector<GpuBinding> VulkanTexture::bindings(std::uint32_t map) const {
  std::vector<GpuBinding> out;
  for (const GpuBuffer& words : words_) out.push_back({kStorage, &words});
  out.push_back({Type::eUniformBuffer, &uniforms_, map * uniform_stride_, sizeof(btfc_gpu_params)});
  return out;
}

std::vector<GpuConstant> VulkanTexture::constants(std::uint32_t map) const {
  std::vector<GpuConstant> out = {{kModelConstant, model_},
                                  {kRobustConstant, options_.robust ? 1u : 0u},
                                  {kFilterConstant, options_.linear ? 1u : 0u}};
  for (std::uint32_t i = 0; i < fixed_params_ && options_.baked; ++i)
    out.push_back({kParamConstant + i, params_[map].words[i]});
  return out;
}

Result<std::span<const std::uint32_t>> VulkanTexture::shader(const std::string& entry) const {
  return options_.general ? general_shader(entry) : model_shader(entry, model_);
}

VulkanTexture::Decoding& VulkanTexture::decoding(const std::string& entry, ShaderStage stage,
                                                 std::uint32_t map) {
  const auto [at, fresh] = decodings_.try_emplace({entry, stage, map});
  Decoding& d = at->second;
  if (!fresh) return d;
  if (stage == ShaderStage::compute) {
    d.pipeline = device_->make_compute(*shader(entry + ".comp"),
                                       types_with({Type::eStorageImage, Type::eStorageImage}),
                                       sizeof(DecodePush), constants(map));
    return d;
  }
  d.render_pass = device_->make_render_pass(kValues, vk::Format::eUndefined);
  VulkanDevice::Graphics graphics;
  graphics.vertex = *general_shader("btfc_full.vert");
  graphics.fragment = *shader(entry + ".frag");
  const std::vector<Type> types = types_with({Type::eStorageImage});
  const std::vector<GpuConstant> special = constants(map);
  graphics.bindings = types;
  graphics.push_size = sizeof(DecodePush);
  graphics.constants = special;
  graphics.colour = kValues;
  d.pipeline = device_->make_graphics(graphics, d.render_pass);
  return d;
}

const GpuImage& VulkanTexture::values_image(std::uint32_t width, std::uint32_t height) {
  if (values_.width != width || values_.height != height) {
    values_ =
        device_->make_image(width, height, kValues,
                            vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eColorAttachment |
                                vk::ImageUsageFlagBits::eTransferSrc);
  }
  return values_;
}

const GpuImage& VulkanTexture::queries_image(std::uint32_t width, std::uint32_t height,
                                             std::span<const std::uint32_t> queries) {
  const std::uint32_t none[4] = {};
  const bool listed = !queries.empty();
  const std::uint32_t columns = listed ? 3 * width : 1, rows = listed ? height : 1;
  if (queries_.width == columns && queries_.height == rows && !listed) return queries_;
  if (queries_.width != columns || queries_.height != rows) {
    queries_ = device_->make_image(columns, rows, vk::Format::eR32G32B32A32Uint,
                                   vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eTransferDst);
  }
  device_->upload(queries_, std::as_bytes(listed ? queries : std::span<const std::uint32_t>(none)),
                  vk::ImageLayout::eGeneral);
  return queries_;
}

std::vector<float> VulkanTexture::decode(const std::string& entry, ShaderStage stage, std::uint32_t map,
                                         const DecodePush& push, std::span<const std::uint32_t> queries) {
  const std::uint32_t width = push.size[0], height = push.size[1];
  Decoding& d = decoding(entry, stage, map);
  const GpuImage& values = values_image(width, height);
  const GpuImage& list = queries_image(width, height, queries);
  std::vector<GpuBinding> bound = bindings(map);
  bound.push_back({.type = Type::eStorageImage, .image = &list});
  if (stage == ShaderStage::compute) bound.push_back({.type = Type::eStorageImage, .image = &values});
  const GpuSet set = device_->make_set(d.pipeline, bound);
  if (stage == ShaderStage::compute) {
    device_->submit([&](const vk::raii::CommandBuffer& commands) {
      change_layout(commands, values, vk::ImageLayout::eUndefined, vk::ImageLayout::eGeneral);
      push_constants(commands, d.pipeline, push);
      dispatch(commands, d.pipeline, set, width, height);
      change_layout(commands, values, vk::ImageLayout::eGeneral, vk::ImageLayout::eTransferSrcOptimal);
    });
    return floats_of(device_->download(values, 16));
  }
  const vk::raii::Framebuffer target(
      device_->device(), vk::FramebufferCreateInfo({}, *d.render_pass, 1, &*values.view, width, height, 1));
  device_->submit([&](const vk::raii::CommandBuffer& commands) {
    const vk::Rect2D area({0, 0}, {width, height});
    const vk::ClearValue clear(vk::ClearColorValue(std::array<float, 4>{}));
    commands.beginRenderPass(vk::RenderPassBeginInfo(*d.render_pass, *target, area, clear),
                             vk::SubpassContents::eInline);
    commands.bindPipeline(vk::PipelineBindPoint::eGraphics, *d.pipeline.pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eGraphics, *d.pipeline.layout, 0, *set.set, {});
    commands.setViewport(0, vk::Viewport(0, 0, static_cast<float>(width), static_cast<float>(height), 0, 1));
    commands.setScissor(0, area);
    push_constants(commands, d.pipeline, push);
    commands.draw(3, 1, 0, 0);
    commands.endRenderPass();
  });
  return floats_of(device_->download(values, 16));
}

ShaderRates VulkanTexture::rates(std::uint32_t map, const btfc_directions& directions, std::uint32_t width,
                                 std::uint32_t height, std::span<const std::byte> rgba8, double seconds) {
  struct Push {
    float view[4], light[4];
    std::uint32_t size[2], texture_size[2];
  } push{};
  std::copy_n(directions.view, 3, push.view);
  std::copy_n(directions.light, 3, push.light);
  push.view[3] = directions.footprint;
  push.size[0] = width;
  push.size[1] = height;
  // Of an unbounded texture, what was prepared.
  const bool unbounded = texture_ != nullptr && btfc_texture_unbounded(texture_) != 0;
  push.texture_size[0] = unbounded ? std::max(options_.window.width, 1u) : params_[map].words[0];
  push.texture_size[1] = unbounded ? std::max(options_.window.height, 1u) : params_[map].words[1];
  const GpuImage image =
      device_->make_image(width, height, vk::Format::eR8G8B8A8Unorm,
                          vk::ImageUsageFlagBits::eSampled | vk::ImageUsageFlagBits::eTransferDst);
  device_->upload(image, rgba8, vk::ImageLayout::eShaderReadOnlyOptimal);
  const vk::raii::Sampler sampler(device_->device(), vk::SamplerCreateInfo());
  const GpuImage& values = values_image(width, height);
  std::vector<GpuBinding> bound = bindings(map);
  bound.push_back({.type = Type::eCombinedImageSampler, .image = &image, .sampler = *sampler});
  bound.push_back({.type = Type::eStorageImage, .image = &values});
  const auto types = types_with({Type::eCombinedImageSampler, Type::eStorageImage});

  // full, fetch, random full, random fetch
  std::array<GpuPipeline, 4> pipelines;
  std::array<GpuSet, 4> sets;
  std::array<std::vector<double>, 4> rates;
  for (std::uint32_t i = 0; i < 4; ++i) {
    std::vector<GpuConstant> special = constants(map);
    special.push_back({kFetchesConstant, i % 2});
    special.push_back({kTexelsConstant, i < 2 ? 1u : 8u});
    pipelines[i] = device_->make_compute(*shader("btfc_bench.comp"), types, sizeof push, special);
    sets[i] = device_->make_set(pipelines[i], bound);
  }
  const auto once = [&](std::uint32_t i) {
    device_->submit([&](const vk::raii::CommandBuffer& commands) {
      change_layout(commands, values, vk::ImageLayout::eUndefined, vk::ImageLayout::eGeneral);
      push_constants(commands, pipelines[i], push);
      dispatch(commands, pipelines[i], sets[i], push.size[0], push.size[1]);
    });
  };
  // In turns, so that a disturbance of the machine meets all; the first round warms up. Of slow models a part
  // of the image, so that a round ends.
  using Clock = std::chrono::steady_clock;
  constexpr std::uint32_t kLeastSide = 64;
  const std::array<std::uint32_t, 2> whole_size = {width, height};
  push.size[0] = std::min(width, kLeastSide);
  push.size[1] = std::min(height, kLeastSide);
  for (once(2);;) {
    const auto from = Clock::now();
    once(2);
    const double spent = std::chrono::duration<double>(Clock::now() - from).count();
    if (8 * spent > seconds || (push.size[0] == width && push.size[1] == height)) break;
    for (std::size_t axis : {0u, 1u}) push.size[axis] = std::min(2 * push.size[axis], whole_size[axis]);
  }
  const double texels = double{1} * push.size[0] * push.size[1];
  const auto begin = Clock::now();
  constexpr int kLeastRounds = 3;
  for (int round = 0;
       round <= kLeastRounds || std::chrono::duration<double>(Clock::now() - begin).count() < seconds;
       ++round) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const auto from = Clock::now();
      once(i);
      const double spent = std::chrono::duration<double>(Clock::now() - from).count();
      if (round > 0) rates[i].push_back(texels * (i < 2 ? 1 : 8) / spent);
    }
  }
  return {median(rates[0]), median(rates[1]), median(rates[2]), median(rates[3]), push.size[0], push.size[1]};
}

// ---- the facade

VulkanDecoder::VulkanDecoder(std::unique_ptr<VulkanTexture> texture) : texture_(std::move(texture)) {}
VulkanDecoder::VulkanDecoder(VulkanDecoder&&) noexcept = default;
VulkanDecoder& VulkanDecoder::operator=(VulkanDecoder&&) noexcept = default;
VulkanDecoder::~VulkanDecoder() = default;

namespace {

Result<std::unique_ptr<VulkanTexture>> open_texture(const ShaderData& data, const btfc_texture* texture,
                                                    const VulkanOptions& options) {
  if (const auto found = general_shader("btfc_full.vert"); !found) return found.error();
  Result<std::unique_ptr<VulkanDevice>> device = VulkanDevice::open({}, options.validation);
  if (!device) return device.error();
  return vulkan_call([&]() -> Result<std::unique_ptr<VulkanTexture>> {
    return std::make_unique<VulkanTexture>(std::move(*device), data, texture, options);
  });
}

}  // namespace

Result<VulkanDecoder> VulkanDecoder::open(const ShaderData& data, const VulkanOptions& options) {
  Result<std::unique_ptr<VulkanTexture>> made = open_texture(data, nullptr, options);
  if (!made) return made.error();
  return VulkanDecoder(std::move(*made));
}

Result<VulkanDecoder> VulkanDecoder::open(const btfc_texture* texture, const VulkanOptions& options) {
  const Result<ShaderData> data = shader_data(texture);
  if (!data) return data.error();
  Result<std::unique_ptr<VulkanTexture>> made = open_texture(*data, texture, options);
  if (!made) return made.error();
  VulkanDecoder out(std::move(*made));
  if (const auto done = out.prepare(options.window); !done) return done.error();
  return out;
}

Result<Done> VulkanDecoder::prepare(const btfc_gpu_window& window) {
  if (window.width == 0 && window.height == 0) return Done{};
  return vulkan_call([&] { return texture_->prepare(window); });
}

const std::string& VulkanDecoder::device_name() const { return texture_->device().name(); }
const std::vector<std::string>& VulkanDecoder::messages() const { return texture_->device().messages(); }

Result<std::vector<float>> VulkanDecoder::rectangle(ShaderStage stage, std::uint32_t map,
                                                    const btfc_directions& directions, std::int32_t x,
                                                    std::int32_t y, std::uint32_t width,
                                                    std::uint32_t height) {
  DecodePush push{};
  std::copy_n(directions.view, 3, push.view);
  std::copy_n(directions.light, 3, push.light);
  push.view[3] = directions.footprint;
  push.level = directions.level;
  // In blocks that any device's images hold.
  constexpr std::uint32_t kBlock = 2048;
  return vulkan_call([&]() -> Result<std::vector<float>> {
    std::vector<float> out(std::size_t{4} * width * height);
    for (std::uint32_t top = 0; top < height; top += kBlock) {
      for (std::uint32_t left = 0; left < width; left += kBlock) {
        push.origin[0] = static_cast<std::int32_t>(static_cast<std::uint32_t>(x) + left);
        push.origin[1] = static_cast<std::int32_t>(static_cast<std::uint32_t>(y) + top);
        push.size[0] = std::min(kBlock, width - left);
        push.size[1] = std::min(kBlock, height - top);
        const std::vector<float> block = texture_->decode("btfc_decode", stage, map, push, {});
        for (std::uint32_t row = 0; row < push.size[1]; ++row) {
          std::copy_n(block.begin() + std::ptrdiff_t{4} * row * push.size[0], std::size_t{4} * push.size[0],
                      out.begin() + 4 * (static_cast<std::ptrdiff_t>(top + row) * width + left));
        }
      }
    }
    return out;
  });
}

namespace {

// Rows of queries: as square as may be.
DecodePush push_for(std::size_t count, std::uint32_t source) {
  constexpr std::size_t kMostColumns = 1024;
  DecodePush push{};
  push.size[0] = static_cast<std::uint32_t>(std::min(count, kMostColumns));
  push.size[1] = static_cast<std::uint32_t>((count + push.size[0] - 1) / push.size[0]);
  push.source = source;
  return push;
}

// The words of the image of queries: three texels each, the last row filled up with zeros.
template <class Query, class Write>
std::vector<std::uint32_t> query_words(std::span<const Query> queries, const DecodePush& push,
                                       const Write& write) {
  std::vector<std::uint32_t> words(std::size_t{12} * push.size[0] * push.size[1]);
  for (std::size_t q = 0; q < queries.size(); ++q) write(queries[q], &words[12 * q]);
  return words;
}

template <class Three>
void write_three(const Three& from, std::uint32_t* to) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = std::bit_cast<std::uint32_t>(from[i]);
}

}  // namespace

Result<std::vector<float>> VulkanDecoder::queries(ShaderStage stage, std::uint32_t map,
                                                  std::span<const btfc_query> queries) {
  if (queries.empty()) return std::vector<float>();
  const DecodePush push = push_for(queries.size(), 1);
  const auto words = query_words(queries, push, [](const btfc_query& q, std::uint32_t* to) {
    to[0] = static_cast<std::uint32_t>(q.x);
    to[1] = static_cast<std::uint32_t>(q.y);
    to[2] = q.level;
    to[3] = std::bit_cast<std::uint32_t>(q.footprint);
    write_three(q.view, to + 4);
    write_three(q.light, to + 8);
  });
  return vulkan_call([&]() -> Result<std::vector<float>> {
    std::vector<float> values = texture_->decode("btfc_decode", stage, map, push, words);
    values.resize(4 * queries.size());
    return values;
  });
}

Result<std::vector<float>> VulkanDecoder::samples(ShaderStage stage, std::uint32_t map,
                                                  std::span<const ShaderSample> samples) {
  if (samples.empty()) return std::vector<float>();
  const DecodePush push = push_for(samples.size(), 0);
  const auto words = query_words(samples, push, [](const ShaderSample& s, std::uint32_t* to) {
    to[0] = std::bit_cast<std::uint32_t>(s.uv[0]);
    to[1] = std::bit_cast<std::uint32_t>(s.uv[1]);
    to[3] = std::bit_cast<std::uint32_t>(s.footprint);
    write_three(s.view, to + 4);
    write_three(s.light, to + 8);
  });
  return vulkan_call([&]() -> Result<std::vector<float>> {
    std::vector<float> values = texture_->decode("btfc_sample", stage, map, push, words);
    values.resize(4 * samples.size());
    return values;
  });
}

Result<ShaderRates> VulkanDecoder::rates(std::uint32_t map, const btfc_directions& directions,
                                         std::uint32_t width, std::uint32_t height,
                                         std::span<const std::byte> rgba8, double seconds) {
  return vulkan_call([&]() -> Result<ShaderRates> {
    return texture_->rates(map, directions, width, height, rgba8, seconds);
  });
}

}  // namespace btfc
