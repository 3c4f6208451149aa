// SPIR-V of the entry points by name.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "format/result.h"

namespace btfc {

// Of an entry point for any model: "btfc_decode.comp". An error where btfc
// was built without glslang.
Result<std::span<const std::uint32_t>> general_shader(const std::string& entry);

// Of an entry point made for one model alone: the same, with less for a driver to compile.
Result<std::span<const std::uint32_t>> model_shader(const std::string& entry, std::uint32_t model);

}  // namespace btfc
