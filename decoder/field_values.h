// Models car, gmrf and car3d on the CPU: tiles of finished colours, kept in a cache of a bounded size.
#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "decoder/model_table.h"

namespace btfc {

// See DecoderModel.
std::shared_ptr<void> field_make_cache(const LoadedItem& item);
void field_eval_queries(const LoadedItem& item, std::uint32_t map, std::span<const BtfcQuery> queries,
                        void* cache, float* out);
void field_decode_cached(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query,
                         std::uint32_t width, std::uint32_t height, void* cache, float* out);
Result<Done> field_select(LoadedItem& item, const Selection& selection);

}  // namespace btfc
