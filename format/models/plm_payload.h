// Model plm, format layer: lobes of each view and texel, or codebooks of them, and polynomials of each pair
// <-> chunks, words and sizes (spec/models/plm.md).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kPlmParameters = 5;  // rho, a1, a2, a3, n
inline constexpr std::uint32_t kPlmTerms = 5;       // of eq. 4
inline constexpr std::uint32_t kPlmMostClusters = 256;

// How POLY was fitted: option --polynomial. A file says only whether it is there.
inline constexpr const char* kPlmPolynomialNames[] = {"none", "histogram", "least-squares"};

// PARM.
struct PlmShape {
  Precision lobes = Precision::f32, terms = Precision::f32;
  bool polynomials = true;
  std::uint32_t clusters = 0;  // entries of a view's and channel's codebook; 0: none, a lobe a texel
  bool operator==(const PlmShape&) const = default;
};

// Rows of lobes: a parameter of all channels (of all maps, in their order), then the next parameter's;
// columns are texels in rows from the top, or entries of the codebook. entries: of a view with codebooks,
// channels x texels. Rows of terms: b1 of all channels, then b2 …; columns are pairs.
struct PlmPayload {
  Directions directions;
  std::vector<CodedRows> lobes;  // one a view
  std::vector<std::vector<std::uint8_t>> entries;
  CodedRows terms;
};

// --precision, --table-precision, --polynomial, --clusters.
Result<PlmShape> plm_shape_from_options(const OptionValues& options);
Bytes write_plm_parm(const PlmShape& shape);
// Rules PL1 and PL2.
Result<PlmShape> read_plm_parm(const Head& head, ByteView parm);

// The closed formulas of spec/models/plm.md.
std::uint64_t plm_formula_bits(const Head& head, const PlmShape& shape);
std::uint64_t plm_memory_bits(const Head& head, const PlmShape& shape);
// Survey, Table 6: s (5 n_r n_c + 5 n_i) n_v values; missing pairs are not counted.
std::uint64_t plm_paper_values(const Head& head);

std::vector<RawChunk> plm_write(const Head& head, const PlmShape& shape, const PlmPayload& payload);

// The model's row.
Result<ItemDescription> plm_describe(const OptionValues& options);
Result<Layout> plm_layout(const Head& head, ByteView parm);
Result<LoadedItem> plm_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
Result<Bytes> plm_reduced(const Head& head, ByteView parm, const Knobs& knobs);
extern const std::span<const std::uint32_t> kPlmChunkTypes;
extern const std::span<const OptionSpec> kPlmSizeOptions;

}  // namespace btfc
