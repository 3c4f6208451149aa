// Model pcarf, format layer: a set of weighted images a view
// (spec/models/pcarf.md).
#pragma once
#include <span>

#include "format/models/weighted_images.h"

namespace btfc {

inline constexpr WeightedModel kPcarfModel = {ModelId::pcarf, "PF1", "PF2", "PF3", true};

// The model's row.
Result<ItemDescription> pcarf_describe(const OptionValues& options);
Result<Layout> pcarf_layout(const Head& head, ByteView parm);
Result<LoadedItem> pcarf_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const OptionSpec> kPcarfSizeOptions;

}  // namespace btfc
