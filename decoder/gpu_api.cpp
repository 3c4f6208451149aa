// The C interface's part for GPUs: words, parameters, planes, the plan, and the embedded SPIR-V.
#include <algorithm>
#include <array>
#include <cstring>

#include "decoder/handles.h"
#include "shaders/btfc_model_ids.h"
#ifdef BTFC_HAS_SPIRV
#include <btfc_general_spirv.h>
#endif

namespace {

using namespace btfc;

static_assert(BTFC_MODEL_PATCH == static_cast<uint>(ModelId::patch) &&
              BTFC_MODEL_GM == static_cast<uint>(ModelId::gm) &&
              BTFC_MODEL_CAR == static_cast<uint>(ModelId::car) &&
              BTFC_MODEL_PTM == static_cast<uint>(ModelId::ptm) &&
              BTFC_MODEL_PLM == static_cast<uint>(ModelId::plm) &&
              BTFC_MODEL_PCARF == static_cast<uint>(ModelId::pcarf) &&
              BTFC_MODEL_PCA == static_cast<uint>(ModelId::pca) &&
              BTFC_MODEL_LPCA == static_cast<uint>(ModelId::lpca) &&
              BTFC_MODEL_GMRF == static_cast<uint>(ModelId::gmrf) &&
              BTFC_MODEL_CAR3D == static_cast<uint>(ModelId::car3d));

btfc_gpu_pass pass_of(const GpuPass& from) {
  btfc_gpu_pass pass{};
  pass.shader = from.shader;
  std::copy(from.groups.begin(), from.groups.end(), pass.groups);
  std::copy(from.push.begin(), from.push.end(), pass.push);
  pass.push_size = 4 * static_cast<std::uint32_t>(from.push.size());
  return pass;
}

}  // namespace

struct btfc_gpu_plan {
  btfc_gpu_plan(const LoadedItem& item, const GpuPrepare& prepare, std::uint32_t fixed_params) {
    info.model = static_cast<std::uint32_t>(item.head.model);
    for (std::size_t slot = 0; slot < kWordSlots; ++slot) {
      info.words_upload[slot] = 4 * item.words[slot].size();
      info.words_size[slot] =
          4 * std::max<std::uint64_t>({item.words[slot].size(), prepare.made_words[slot], 1});
    }
    info.scratch_size = prepare.scratch_bytes;
    for (const GpuPass& pass : prepare.passes) passes.push_back(pass_of(pass));
    for (const std::vector<std::uint32_t>& words : prepare.map_params)
      std::copy(words.begin(), words.end(), params.emplace_back().words);
    info.passes = passes.data();
    info.pass_count = static_cast<std::uint32_t>(passes.size());
    info.params = params.data();
    info.map_count = static_cast<std::uint32_t>(params.size());
    info.fixed_params = fixed_params;
  }

  btfc_gpu_plan_info info{};
  // What its pointers point to.
  std::vector<btfc_gpu_pass> passes;
  std::vector<btfc_gpu_params> params;
};

size_t btfc_gpu_params_size(const btfc_texture* texture, uint32_t map) {
  return map < btfc_texture_maps(texture) ? 4 * texture->item.map_params[map].size() : 0;
}

btfc_result btfc_gpu_write_params(const btfc_texture* texture, uint32_t map, void* params,
                                  size_t params_size) {
  if (texture == nullptr || params == nullptr || map >= btfc_texture_maps(texture) ||
      params_size < btfc_gpu_params_size(texture, map)) {
    return bad(nullptr, "");
  }
  std::memcpy(params, texture->item.map_params[map].data(), btfc_gpu_params_size(texture, map));
  return BTFC_OK;
}

size_t btfc_gpu_words_size(const btfc_texture* texture, uint32_t slot) {
  return slot < BTFC_WORD_SLOTS ? 4 * texture->item.words[slot].size() : 0;
}

btfc_result btfc_gpu_write_words(const btfc_texture* texture, uint32_t slot, void* words, size_t words_size) {
  if (texture == nullptr || slot >= BTFC_WORD_SLOTS || words_size < btfc_gpu_words_size(texture, slot))
    return bad(nullptr, "");
  if (btfc_gpu_words_size(texture, slot) == 0) return BTFC_OK;
  if (words == nullptr) return bad(nullptr, "");
  std::memcpy(words, texture->item.words[slot].data(), btfc_gpu_words_size(texture, slot));
  return BTFC_OK;
}

uint32_t btfc_gpu_planes(const btfc_texture* texture) {
  return static_cast<uint32_t>(texture->item.planes.size());
}

btfc_result btfc_gpu_plane_info(const btfc_texture* texture, uint32_t plane, btfc_plane_info* info_ret) {
  if (texture == nullptr || info_ret == nullptr || plane >= btfc_gpu_planes(texture)) return bad(nullptr, "");
  const Plane& p = texture->item.planes[plane];
  *info_ret = {p.width, p.height,    p.channels, p.texel_bits, static_cast<btfc_sample>(p.type),
               p.slot,  p.first_word};
  return BTFC_OK;
}

btfc_result btfc_gpu_plan_new(const btfc_texture* texture, const btfc_gpu_window* window,
                              btfc_gpu_plan** plan_ret, btfc_error* error) {
  if (plan_ret == nullptr) return bad(error, "plan_ret is NULL");
  *plan_ret = nullptr;
  if (texture == nullptr) return bad(error, "texture is NULL");
  return guarded(error, [&] {
    GpuWindow wanted;
    if (window != nullptr) wanted = {window->x, window->y, window->width, window->height};
    GpuPrepare prepare;
    prepare.map_params = texture->item.map_params;
    if (texture->model->prepare != nullptr) {
      Result<GpuPrepare> made = texture->model->prepare(texture->item, wanted);
      if (!made) return report(made.error(), error);
      prepare = *std::move(made);
    }
    *plan_ret = new btfc_gpu_plan(texture->item, prepare, texture->model->fixed_params);
    return BTFC_OK;
  });
}

const btfc_gpu_plan_info* btfc_gpu_plan_get(const btfc_gpu_plan* plan) {
  return plan != nullptr ? &plan->info : nullptr;
}

void btfc_gpu_plan_free(btfc_gpu_plan* plan) { delete plan; }

const uint32_t* btfc_gpu_shader(const char* name, size_t* size_ret) {
  if (size_ret != nullptr) *size_ret = 0;
  if (name == nullptr) return nullptr;
#ifdef BTFC_HAS_SPIRV
  for (const auto& shader : btfc_general_spirv::kShaders) {
    if (std::strcmp(name, shader.name) != 0) continue;
    if (size_ret != nullptr) *size_ret = shader.size;
    return shader.words;
  }
#endif
  return nullptr;
}
