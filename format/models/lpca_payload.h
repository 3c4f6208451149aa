// Model lpca, format layer: cluster numbers and weights a texel, means and eigenvectors a cluster <-> chunks,
// words and sizes (spec/models/lpca.md).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kLpcaMostClusters = 65536;
inline constexpr std::uint32_t kLpcaMostRank = 255;  // a component is a level, and levels have 8 bits

// PARM.
struct LpcaShape {
  std::uint32_t clusters = 1;  // 1 … 65536
  std::uint32_t rank = 0;      // components beside the mean, 0 … 255
  Precision texels = Precision::f32, tables = Precision::f32;
  bool operator==(const LpcaShape&) const = default;
};

// Rows of means and eigenvectors are (cluster, channel), columns pairs; weights are one row, columns texels.
struct LpcaPayload {
  Directions directions;
  std::vector<std::uint16_t> cluster;  // one a texel, in rows from the top
  CodedRows means;
  std::vector<CodedRows> vectors, weights;  // rank of each
};

// --clusters, --rank, --precision, --table-precision.
Result<LpcaShape> lpca_shape_from_options(const OptionValues& options);
Bytes write_lpca_parm(const LpcaShape& shape);
// Rules LP1 and LP2.
Result<LpcaShape> read_lpca_parm(const Head& head, ByteView parm);

// The closed formulas of spec/models/lpca.md.
std::uint64_t lpca_formula_bits(const Head& head, const LpcaShape& shape);
std::uint64_t lpca_memory_bits(const Head& head, const LpcaShape& shape);
// Survey, Table 6: n + s c n_i n_v (k + 1) values, which leaves out the k n weights; its Table 7 counts them.
std::uint64_t lpca_paper_values(const Head& head, const LpcaShape& shape);

std::vector<RawChunk> lpca_write(const Head& head, const LpcaShape& shape, const LpcaPayload& payload);

// The model's row.
Result<ItemDescription> lpca_describe(const OptionValues& options);
Result<Layout> lpca_layout(const Head& head, ByteView parm);
Result<LoadedItem> lpca_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
Result<Bytes> lpca_reduced(const Head& head, ByteView parm, const Knobs& knobs);
extern const std::span<const std::uint32_t> kLpcaChunkTypes;
extern const std::span<const OptionSpec> kLpcaSizeOptions;

}  // namespace btfc
