// Model pca, format layer: mean image, eigenimages and weights <-> chunks, words and sizes
// (spec/models/pca.md).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kPcaMostRank = 255;  // a component is a level, and levels have 8 bits

// PARM.
struct PcaShape {
  std::uint32_t rank = 0;  // components beside the mean, 0 … 255
  Precision texels = Precision::f32, tables = Precision::f32;
  bool operator==(const PcaShape&) const = default;
};

// Rows of images are channels (of all maps, in their order), columns texels in rows from the top; rows of
// weights are single, columns pairs.
struct PcaPayload {
  Directions directions;
  CodedRows mean;
  std::vector<CodedRows> images, weights;  // rank of each
};

Bytes write_pca_parm(const PcaShape& shape);
// Rules PC1 and PC2.
Result<PcaShape> read_pca_parm(const Head& head, ByteView parm);

// The closed formulas of spec/models/pca.md.
std::uint64_t pca_formula_bits(const Head& head, const PcaShape& shape);
std::uint64_t pca_memory_bits(const Head& head, const PcaShape& shape);
// Survey, Table 6: s n (k + 1) + k n_i n_v values.
std::uint64_t pca_paper_values(const Head& head, const PcaShape& shape);

std::vector<RawChunk> pca_write(const Head& head, const PcaShape& shape, const PcaPayload& payload);

// The model's row.
Result<ItemDescription> pca_describe(const OptionValues& options);
Result<Layout> pca_layout(const Head& head, ByteView parm);
Result<LoadedItem> pca_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const std::uint32_t> kPcaChunkTypes;
extern const std::span<const OptionSpec> kPcaSizeOptions;

}  // namespace btfc
