// Models car, gmrf and car3d on a GPU: the prepared atlas, which holds the collapsed pyramid over a window
// (shaders/models/field.h), the passes that make it, and the same made here.
#pragma once
#include <cstdint>
#include <vector>

#include "decoder/model_table.h"
#include "shaders/models/field.h"

namespace btfc {

// Vulkan's guaranteed minimum of a storage buffer.
inline constexpr std::uint64_t kFieldMostAtlasBytes = std::uint64_t{1} << 27;
// How much scratch the passes ask for at most: the more, the fewer of them.
inline constexpr std::uint64_t kFieldMostScratchBytes = std::uint64_t{1} << 25;

// See DecoderModel. The atlas goes to slot 2. With a period any window is replaced by the whole period.
Result<GpuPrepare> field_prepare(const LoadedItem& item, const GpuWindow& window);

// The atlas that params of field_prepare speak of, by the CPU: bit for bit what its passes make where
// operations are rounded as in binary32. For engines without compute shaders, and as a reference.
std::vector<std::uint32_t> field_atlas(const LoadedItem& item, const FieldParams& with_atlas);

}  // namespace btfc
