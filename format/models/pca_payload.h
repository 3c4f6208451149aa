// Model pca, format layer: one set of weighted images for the whole BTF
// (spec/models/pca.md).
#pragma once
#include <span>

#include "format/models/weighted_images.h"

namespace btfc {

inline constexpr WeightedModel kPcaModel = {ModelId::pca, "PC1", "PC2", "PC3", false};

// The model's row.
Result<ItemDescription> pca_describe(const OptionValues& options);
Result<Layout> pca_layout(const Head& head, ByteView parm);
Result<LoadedItem> pca_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const OptionSpec> kPcaSizeOptions;

}  // namespace btfc
