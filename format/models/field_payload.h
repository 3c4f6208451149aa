// Models car, gmrf and car3d: what a file holds <-> chunks and words (spec/models/car.md).
#pragma once
#include <cstdint>
#include <vector>

#include "format/directions.h"
#include "format/models/field_band.h"
#include "format/models/field_shape.h"

namespace btfc {

struct FieldPayload {
  Directions directions;
  std::vector<std::uint16_t> subspace_of_pair;  // 0 … clusters - 1
  float relief = 0, height_step = 0;            // strength of the bump filter; texels a code of the range map
  std::vector<std::uint16_t> range;             // codes in rows from the top
  std::vector<float> records;                   // clusters x shape.record_numbers()
  std::vector<std::vector<float>> levels;       // of each level clusters x shape.level_numbers(level)
};

std::vector<RawChunk> field_write(const Head& head, const FieldShape& shape, const FieldPayload& payload);

// A loaded item's level, its numbers those of the item's words; seed and period are those of its parameters.
FieldBand field_band_of_words(const LoadedItem& item, const FieldParams& p, std::uint32_t level);

// The models' rows.
template <ModelId kModel>
Result<ItemDescription> field_describe(const OptionValues& options);
extern template Result<ItemDescription> field_describe<ModelId::car>(const OptionValues&);
extern template Result<ItemDescription> field_describe<ModelId::gmrf>(const OptionValues&);
extern template Result<ItemDescription> field_describe<ModelId::car3d>(const OptionValues&);
Result<Layout> field_layout(const Head& head, ByteView parm);
Result<LoadedItem> field_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels);
extern const std::span<const OptionSpec> kFieldSizeOptions;

}  // namespace btfc
