// Model pca, format layer: mean image, eigenimages and weights <-> chunks, words and sizes
// (spec/models/pcarf.md).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kPcarfMostRank = 255;  // a component is a level, and levels have 8 bits

// PARM.
struct PcarfShape {
  std::uint32_t rank = 0;  // components beside the mean, 0 … 255
  Precision texels = Precision::f32, tables = Precision::f32;
  bool operator==(const PcarfShape&) const = default;
};

// Rows of images are channels (of all maps, in their order), columns texels in rows from the top; rows of
// weights are single, columns pairs.
struct PcarfPayload {
  Directions directions;
  std::vector<CodedRows> means;                // one a view
  std::vector<std::vector<CodedRows>> images;  // [component][view]
  std::vector<CodedRows> weights;              // one a component
};

Bytes write_pcarf_parm(const PcarfShape& shape);
// Rules PF1 and PF2.
Result<PcarfShape> read_pcarf_parm(const Head& head, ByteView parm);

// The closed formulas of spec/models/pcarf.md.
std::uint64_t pcarf_formula_bits(const Head& head, const PcarfShape& shape);
std::uint64_t pcarf_memory_bits(const Head& head, const PcarfShape& shape);
// Survey, Table 6: (s n (k + 1) + k n_i) n_v values.
std::uint64_t pcarf_paper_values(const Head& head, const PcarfShape& shape);

std::vector<RawChunk> pcarf_write(const Head& head, const PcarfShape& shape, const PcarfPayload& payload);

// The model's row.
Result<ItemDescription> pcarf_describe(const OptionValues& options);
Result<Layout> pcarf_layout(const Head& head, ByteView parm);
Result<LoadedItem> pcarf_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const std::uint32_t> kPcarfChunkTypes;
extern const std::span<const OptionSpec> kPcarfSizeOptions;

}  // namespace btfc
