// What the decoder knows of each model: how to answer a query on the CPU.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "format/loaded_item.h"
#include "shaders/btfc_query.h"

namespace btfc {

struct DecoderModel {
  ModelId id;
  // The reference: the shared header of shaders/models/, compiled here. Any query, any thread.
  vec4 (*eval)(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
  // Optional: numbers that the fast paths want precomputed; made once at load. Null: none.
  std::vector<std::uint64_t> (*make_tables)(const LoadedItem& item);
  // Optional second implementation for rectangles inside the texture: samples in the map's own type, channels
  // interleaved, rows row_stride bytes apart. A test holds it against eval. Null: the generic loop is used.
  void (*decode_rows)(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                      std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
                      std::uint8_t* out, std::size_t row_stride);
  // Optional second implementation for texels anywhere: (x, y) pairs, samples as for decode_rows, tightly
  // packed.
  void (*decode_texels)(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                        const std::int32_t* texels, std::size_t count, std::uint8_t* out);
};

const DecoderModel& decoder_model(ModelId id);

// The item's word arrays as the shared headers read them.
BtfcWords words_of(const LoadedItem& item);

}  // namespace btfc
