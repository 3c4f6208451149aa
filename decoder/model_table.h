// What the decoder knows of each model: how to answer a query on the CPU.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "format/loaded_item.h"
#include "format/result.h"
#include "shaders/btfc_query.h"

namespace btfc {

// A window of an unbounded texture, texels of level 0; 0 x 0: none.
struct GpuWindow {
  std::int32_t x = 0, y = 0;
  std::uint32_t width = 0, height = 0;
};

// A dispatch of an entry point of shaders/.
struct GpuPass {
  const char* shader;
  std::array<std::uint32_t, 3> groups;
  std::vector<std::uint32_t> push;
};

// What a GPU makes of an item before it is read: passes in order, a memory barrier between all of them.
struct GpuPrepare {
  std::vector<std::vector<std::uint32_t>> map_params;  // in place of the item's
  std::uint64_t made_words[kWordSlots] = {};           // words of slots that passes fill
  std::uint64_t scratch_bytes = 0;
  std::vector<GpuPass> passes;
};

// What is selected of a freshly loaded item, beside its levels. 0: nothing.
struct Selection {
  std::uint32_t period = 0, relief = 0;  // of unbounded textures
  std::uint32_t gates = 0;               // of gm
  float culling = 0;
};

struct DecoderModel {
  ModelId id;
  // The reference: the shared header of shaders/models/, compiled here. Any query, any thread.
  vec4 (*eval)(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
  // Whether eval's values are those of stored codes, exactly; otherwise they are computed and rounded to
  // codes where codes are asked for (spec/btfc.md section 6).
  bool exact_codes;

  // Of models with exact codes. Optional: numbers that the fast paths want precomputed; made once at load.
  std::vector<std::uint64_t> (*make_tables)(const LoadedItem& item) = nullptr;
  // Optional second implementation for rectangles inside the texture: samples in the map's own type, channels
  // interleaved, rows row_stride bytes apart. A test holds it against eval. Null: the generic loop is used.
  void (*decode_rows)(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                      std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
                      std::uint8_t* out, std::size_t row_stride) = nullptr;
  // Optional second implementation for texels anywhere: (x, y) pairs, samples as for decode_rows, tightly
  // packed.
  void (*decode_texels)(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                        const std::int32_t* texels, std::size_t count, std::uint8_t* out) = nullptr;

  // Of models with computed values. Optional second implementation for a rectangle of texels inside the
  // texture, all under query's directions, its top left one query's: channels interleaved, tightly packed.
  // `state` is what begin_values made for these directions. A test holds it against eval.
  std::vector<float> (*begin_values)(const LoadedItem& item, std::uint32_t map,
                                     const BtfcQuery& query) = nullptr;
  void (*decode_values)(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                        const BtfcQuery& query, std::uint32_t width, std::uint32_t height,
                        float* out) = nullptr;
  // Optional second implementation for many queries of one map under any directions and footprints: values
  // tightly packed. A test holds it against eval. cache: what make_cache made; null of models without.
  void (*eval_queries)(const LoadedItem& item, std::uint32_t map, std::span<const BtfcQuery> queries,
                       void* cache, float* out) = nullptr;

  // Of unbounded models: what is worth keeping between calls, one cache a thread; and with it a rectangle
  // anywhere under query's directions, its top left texel query's, values tightly packed. Tests hold it
  // against eval.
  std::shared_ptr<void> (*make_cache)(const LoadedItem& item) = nullptr;
  void (*decode_cached)(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query,
                        std::uint32_t width, std::uint32_t height, void* cache, float* out) = nullptr;
  // Puts a selection, of which not all is 0, into a freshly loaded item; refuses what the item has not. Null:
  // the model has nothing to select but levels.
  Result<Done> (*select)(LoadedItem& item, const Selection& selection) = nullptr;
  // The most that Selection::gates may be, and whether the model knows Selection::culling.
  std::uint32_t (*most_gates)(const Head& head, ByteView parm) = nullptr;
  bool culls = false;
  // How a GPU prepares a window, or with a period the whole of it.
  Result<GpuPrepare> (*prepare)(const LoadedItem& item, const GpuWindow& window) = nullptr;
  // So many words of the params are the same whatever the window.
  std::uint32_t fixed_params = 32;
};

const DecoderModel& decoder_model(ModelId id);

// <Model>Params of one map, as the format layer laid it out.
template <class Params>
Params params_of(const LoadedItem& item, std::uint32_t map) {
  Params params;
  std::memcpy(&params, item.map_params[map].data(), sizeof params);
  return params;
}

// The item's word arrays as the shared headers read them.
BtfcWords words_of(const LoadedItem& item);

}  // namespace btfc
