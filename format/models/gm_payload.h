// Model gm, format layer: a mixture and the mean BRDF <-> chunks, words and sizes (spec/models/gm.md).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/model_table.h"
#include "format/models/gm_mixture.h"

namespace btfc {

inline constexpr std::uint32_t kGmMostLevels = 16;
inline constexpr std::uint32_t kGmMostMeanRank = 255;

// compact: what decoding uses. paper: 9 means and 9 spreads of binary32 a component, and the weights.
enum class GmLayout : std::uint8_t { compact = 0, paper = 1 };

// PARM.
struct GmParm {
  std::uint32_t components = 600;  // M
  std::uint32_t gates = 0;         // K; 0: all
  std::uint32_t levels = 1;
  GmLayout layout = GmLayout::compact;
  Precision precision = Precision::u8;
  GmMeanForm mean = GmMeanForm::coded;
  std::uint32_t mean_rank = 0;  // of a coded mean
  bool shear = true;
  GmOnion onion = GmOnion::with_sign;
  bool operator==(const GmParm&) const = default;

  GmShape shape(const Head& head) const { return {components, head.channels(), shear}; }
  // Rows of the stored array: those of a mixture; of `paper` means, spreads, the weight.
  std::uint32_t rows(const Head& head) const {
    return layout == GmLayout::paper ? 2 * (kGmInputs + head.channels()) + 1 : shape(head).rows();
  }
};

// What a file holds: rows x M numbers, of `paper` in binary32.
struct GmPayload {
  Directions directions;
  CodedRows rows;
  GmMean mean;
};

// Options that the size formula needs; defaults where they are absent. samples: of the original, for the
// default form of the mean in the layout `paper`.
Result<GmParm> gm_parm_from_options(const OptionValues& options, SampleType samples);

// The same with so many components: as many of its levels as they can have, K where it leaves some out.
GmParm gm_with_components(GmParm parm, std::uint32_t components);

Bytes write_gm_parm(const GmParm& parm);
// Rules GM1 and GM2.
Result<GmParm> read_gm_parm(const Head& head, ByteView raw);

// The closed formulas of spec/models/gm.md.
std::uint64_t gm_formula_bits(const Head& head, const GmParm& parm);
std::uint64_t gm_memory_bits(const Head& head, const GmParm& parm);

std::vector<RawChunk> gm_write(const Head& head, const GmParm& parm, const GmPayload& payload);

// Rows of the layout `paper` -> what decoding uses.
GmMixture gm_mixture_of_paper(const CodedRows& rows, std::uint32_t channels);

// The model's row.
Result<ItemDescription> gm_describe(const OptionValues& options);
Result<Layout> gm_layout(const Head& head, ByteView parm);
Result<LoadedItem> gm_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
// The first levels' components alone, and no more gates.
Result<Bytes> gm_reduced(const Head& head, ByteView parm, const Knobs& knobs);
inline constexpr std::uint32_t kGmChunkTypes[] = {kDirs, four_cc("GMIX"), four_cc("GSCL"), four_cc("MEAN")};
inline constexpr OptionSpec kGmOptions[] = {
    {"components", "M", "components of the mixture, 1 to 65536 (default 600)"},
    {"gates", "K", "the K highest gates of a texel count, 1 to 32, or 0: all (default 0)"},
    {"precision", "f32|f16|u8", "of the components' numbers (default u8; layout paper: f32)"},
    {"mean-brdf", "u8|f32|coded",
     "the mean BRDF: a table, or factors (default coded; layout paper: a table)"},
    {"mean-rank", "R", "factors of a coded mean BRDF, 1 to 255 (default 8)"},
    {"shear", "on|off", "two numbers a component for parallax and drift of shadows (default on)"},
    {"onion", "signed|printed", "angles of directions; printed folds mirror ones together (default signed)"},
    {"layout", "compact|paper", "what decoding uses, or all that the paper counts (default compact)"},
    {"levels", "N", "parts that each double the components, 1 to 16 (default 4)"},
};
extern const std::span<const OptionSpec> kGmSizeOptions;

}  // namespace btfc
