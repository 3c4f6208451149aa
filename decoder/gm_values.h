// Model gm, the fast CPU paths: rectangles under one pair of directions, batches of queries under any. Values
// differ from the shared header's by rounding and by what culling leaves out (kGmError).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "decoder/model_table.h"
#include "format/loaded_item.h"
#include "shaders/btfc_query.h"

namespace btfc {

// Components that weigh less together are left out, so that a value is off by at most this times the range of
// the mixture's outputs; unless the item says otherwise.
inline constexpr float kGmError = 1e-5f;

// What may be chosen in its place.
inline constexpr float kGmLeastCulling = 1e-7f, kGmMostCulling = 0.1f;

// Fewer gates than the file has, and another kGmError.
Result<Done> gm_select(LoadedItem& item, const Selection& selection);
std::uint32_t gm_most_gates(const Head& head, ByteView parm);

// See DecoderModel.
std::vector<float> gm_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
void gm_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                      const BtfcQuery& query, std::uint32_t width, std::uint32_t height, float* out);
void gm_eval_queries(const LoadedItem& item, std::uint32_t map, std::span<const BtfcQuery> queries, void*,
                     float* out);

}  // namespace btfc
