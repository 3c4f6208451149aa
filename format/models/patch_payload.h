// Model patch, format layer: the recipe and the sample <-> chunks, words and sizes (spec/models/patch.md).
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "format/model_table.h"

namespace btfc {

enum class PatchBlend : std::uint8_t { liang = 0, quilting = 1 };
enum class CutLayout : std::uint8_t { none = 0, rgba8 = 1, packed = 2 };

// PARM: everything that sizes depend on.
struct PatchShape {
  std::uint32_t sample_width = 0, sample_height = 0;  // m x n texels
  std::uint32_t count_x = 1, count_y = 1;             // k_x x k_y patches
  std::uint32_t size = 0;                             // w_B
  std::uint32_t overlap = 0;                          // w_E
  PatchBlend blend = PatchBlend::quilting;
  CutLayout cuts = CutLayout::packed;
  bool wraps = false;               // of HEAD: border patches overlap those of the other side
  std::uint32_t stored_blocks = 0;  // of 4x4 texels of the sample; 0: stored whole
  bool operator==(const PatchShape&) const = default;

  std::uint32_t step() const { return size - overlap; }
  std::uint64_t patches() const { return std::uint64_t{count_x} * count_y; }
  std::uint64_t cuts_v() const {
    return blend == PatchBlend::liang ? 0 : std::uint64_t{wraps ? count_x : count_x - 1} * count_y;
  }
  std::uint64_t cuts_h() const {
    return blend == PatchBlend::liang ? 0 : std::uint64_t{wraps ? count_y : count_y - 1} * count_x;
  }
  // Texels of the whole synthesised texture.
  std::uint64_t full_width() const { return std::uint64_t{count_x} * step() + (wraps ? 0 : overlap); }
  std::uint64_t full_height() const { return std::uint64_t{count_y} * step() + (wraps ? 0 : overlap); }
  std::uint32_t blocks_x() const { return (sample_width + 3) / 4; }
  std::uint32_t blocks_y() const { return (sample_height + 3) / 4; }
  bool wide_coordinates() const { return sample_width > 256 || sample_height > 256; }
};

struct PatchPosition {
  std::uint32_t x = 0, y = 0;
  bool operator==(const PatchPosition&) const = default;
};

// The recipe: all that a decoder needs beside the sample. cuts_v and cuts_h hold w_B entries a cut, in the
// order of the spec page; empty for liang.
struct PatchRecipe {
  std::vector<PatchPosition> positions;
  std::vector<std::uint16_t> cuts_v, cuts_h;
  std::vector<bool> blocks;  // which blocks of the sample are stored, in rows; empty: all
  bool operator==(const PatchRecipe&) const = default;
};

// A map's sample: codes in rows from the top, channels interleaved. unorm8 codes are 0 … 255.
using SampleCodes = std::vector<std::uint16_t>;

// Rules PA1 to PA5; width and height are those of HEAD.
Result<Done> check_patch_shape(const PatchShape& shape, const Head& head);

Bytes write_patch_parm(const PatchShape& shape);
Result<PatchShape> read_patch_parm(ByteView parm, const Head& head);

// The closed formulas of spec/models/patch.md section 3, all in bits.
std::uint64_t patch_formula_bits(const PatchShape& shape, std::span<const Map> maps);
// What one map of a set adds: its SMPL.
std::uint64_t patch_map_bits(const PatchShape& shape, const Map& map);
std::uint64_t patch_memory_bits(const PatchShape& shape, std::span<const Map> maps);
std::uint64_t patch_paper_bits(const PatchShape& shape, std::span<const Map> maps);

// Payload chunks, HEAD included. samples holds one entry a map of the head.
std::vector<RawChunk> patch_write(const Head& head, const PatchShape& shape, const PatchRecipe& recipe,
                                  std::span<const SampleCodes> samples);

// The model's row.
Result<ItemDescription> patch_describe(const OptionValues& options);
Result<Layout> patch_layout(const Head& head, ByteView parm);
Result<LoadedItem> patch_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const std::uint32_t> kPatchChunkTypes;
extern const std::span<const OptionSpec> kPatchSizeOptions;

// What the options --k, --wb, --we, --blend, --pack and --size say about a sample of m x n texels, with the
// automatic choices filled in. head's width and height are set: --size, or the full size where it is absent.
Result<PatchShape> patch_shape_from_options(const OptionValues& options, std::uint32_t sample_width,
                                            std::uint32_t sample_height, Head& head);

}  // namespace btfc
