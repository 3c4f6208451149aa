// Model ptm, format layer: six coefficients a view, texel and channel <-> chunks, words and sizes
// (spec/models/ptm.md).
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

// Terms in the order in which they are stored, by level: level 0 has the constant, level 1 the linear terms,
// level 2 the quadratic ones. Index of a term: that of its coefficient in eq. 2.
inline constexpr std::uint32_t kPtmLevels = 3, kPtmTerms = 6;
inline constexpr std::array<std::uint32_t, kPtmTerms> kPtmTermOrder = {5, 3, 4, 0, 1, 2};
inline constexpr std::array<std::uint32_t, kPtmLevels + 1> kPtmFirstTerm = {0, 1, 3, 6};

// PARM.
struct PtmShape {
  Precision precision = Precision::f32;
  bool operator==(const PtmShape&) const = default;
};

// Of one view: level l's rows are term kPtmTermOrder[kPtmFirstTerm[l]] of all channels (of all maps, in their
// order), then the next term's; columns are texels in rows from the top.
using PtmView = std::array<CodedRows, kPtmLevels>;

struct PtmPayload {
  Directions directions;
  std::vector<PtmView> views;
};

Bytes write_ptm_parm(const PtmShape& shape);
// Rules PT1 and PT2.
Result<PtmShape> read_ptm_parm(const Head& head, ByteView parm);

// The closed formulas of spec/models/ptm.md.
std::uint64_t ptm_formula_bits(const Head& head, const PtmShape& shape);
std::uint64_t ptm_memory_bits(const Head& head, const PtmShape& shape);
// Survey, Table 6: 6 s n_r n_c n_v values.
std::uint64_t ptm_paper_values(const Head& head);

std::vector<RawChunk> ptm_write(const Head& head, const PtmShape& shape, const PtmPayload& payload);

// The coefficients of one view: rule PT3.
Result<PtmView> read_ptm_view(const Head& head, const PtmShape& shape, const ChunkReader& read,
                              std::uint32_t view, std::uint32_t levels);

// The model's row.
Result<ItemDescription> ptm_describe(const OptionValues& options);
Result<Layout> ptm_layout(const Head& head, ByteView parm);
Result<LoadedItem> ptm_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const std::uint32_t> kPtmChunkTypes;
extern const std::span<const OptionSpec> kPtmSizeOptions;

}  // namespace btfc
