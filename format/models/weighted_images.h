// What models pca and pcarf store alike: sets of a mean image and eigenimages, and weights of every pair.
// pca has one set for all images, pcarf one a view.
#pragma once
#include <cstdint>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"

namespace btfc {

inline constexpr std::uint32_t kMostRank = 255;  // a component is a level, and levels have 8 bits

// PARM.
struct WeightedShape {
  std::uint32_t rank = 0;  // components beside the mean, 0 … 255
  Precision texels = Precision::f32, tables = Precision::f32;
  bool operator==(const WeightedShape&) const = default;
};

// Rows of images are channels (of all maps, in their order), columns texels in rows from the top; rows of
// weights are single, columns pairs.
struct WeightedImages {
  Directions directions;
  std::vector<CodedRows> means;                // one a set
  std::vector<std::vector<CodedRows>> images;  // [component][set]
  std::vector<CodedRows> weights;              // one a component
};

// What tells the two models apart.
struct WeightedModel {
  ModelId id;
  const char *parm_rule, *size_rule, *rows_rule;
  bool set_a_view;

  std::uint32_t sets(const Head& head) const { return set_a_view ? head.views : 1; }
};

inline constexpr std::uint32_t kWeightedChunkTypes[] = {kDirs, four_cc("IMAG"), four_cc("MEAN"),
                                                        four_cc("WGHT")};
inline constexpr OptionSpec kWeightedOptions[] = {
    {"rank", "K", "components k beside the mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of images and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the table of weights (default: as --precision)"},
};
Result<WeightedShape> weighted_shape_from_options(const OptionValues& options);

Bytes write_weighted_parm(const WeightedShape& shape);
Result<WeightedShape> read_weighted_parm(const WeightedModel& model, const Head& head, ByteView parm);

// S (k + 1) images of s channels and k rows of weights; the S sets' s n values each (survey, Table 6).
std::uint64_t weighted_formula_bits(const WeightedModel& model, const Head& head, const WeightedShape& shape);
std::uint64_t weighted_memory_bits(const WeightedModel& model, const Head& head, const WeightedShape& shape);
std::uint64_t weighted_paper_values(const WeightedModel& model, const Head& head, const WeightedShape& shape);

std::vector<RawChunk> weighted_write(const WeightedModel& model, const Head& head, const WeightedShape& shape,
                                     const WeightedImages& payload);

Result<ItemDescription> weighted_describe(const WeightedModel& model, const OptionValues& options);
// All but the cost, which depends on how the sets are used.
Result<Layout> weighted_layout(const WeightedModel& model, const Head& head, const WeightedShape& shape);

// An item without its map_params, and where they find things in slot 0.
struct WeightedItem {
  LoadedItem item;
  WeightedShape shape;  // rank: of the levels that were read
  DirectionWords at;
  std::uint32_t scale_word = 0;     // channel c of component k (0 is the mean) of set v has scale
                                    // (v (rank + 1) + k) channels + c
  std::uint32_t weight_scale = 0;   // number of the first scale of the weights
  std::uint32_t weight_word = 0;    // rank elements a pair
  std::uint32_t rows_per_slot = 0;  // of slots 1 to 3: row set * texels + texel
};
Result<WeightedItem> weighted_load(const WeightedModel& model, const Head& head, ByteView parm,
                                   const ChunkReader& read, std::uint32_t levels);

Result<Bytes> weighted_reduced(const WeightedModel& model, const Head& head, ByteView parm,
                               const Knobs& knobs);
template <const WeightedModel& model>
Result<Bytes> weighted_reduced(const Head& head, ByteView parm, const Knobs& knobs) {
  return weighted_reduced(model, head, parm, knobs);
}

}  // namespace btfc
