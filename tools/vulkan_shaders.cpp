// Lookups in what was embedded.
#include "tools/vulkan_shaders.h"

#include <fmt/format.h>

#include "btfc/btfc.h"
#include "format/model_table.h"
#ifdef BTFC_HAS_SPIRV
#include <btfc_model_spirv.h>
#endif

namespace btfc {
namespace {

// What the tools hold themselves.
Result<std::span<const std::uint32_t>> own_shader(const std::string& name) {
#ifdef BTFC_HAS_SPIRV
  for (const auto& shader : btfc_model_spirv::kShaders) {
    if (name == shader.name) return std::span(shader.words, shader.size / sizeof(std::uint32_t));
  }
#endif
  return unsupported("", 0, fmt::format("this btfc holds no shader '{}': built without glslang", name));
}

}  // namespace

Result<std::span<const std::uint32_t>> general_shader(const std::string& entry) {
  std::size_t size = 0;
  const std::uint32_t* words = btfc_gpu_shader(entry.c_str(), &size);
  if (words == nullptr) return own_shader(entry);
  return std::span(words, size / sizeof(std::uint32_t));
}

Result<std::span<const std::uint32_t>> model_shader(const std::string& entry, std::uint32_t model) {
  // "btfc_decode.comp" -> "btfc_decode.pca.comp"
  const std::size_t dot = entry.find('.');
  const std::string name =
      entry.substr(0, dot) + '.' + find_model(static_cast<ModelId>(model))->name + entry.substr(dot);
  return own_shader(name);
}

}  // namespace btfc
