// The PCA models, the fast CPU path: many texels under the same directions. What depends on the directions is
// reckoned once; sums are taken in the order of the shared headers, so the values are the same bit for bit.
#pragma once
#include <vector>

#include "format/loaded_item.h"
#include "shaders/btfc_query.h"

namespace btfc {

// See DecoderModel::begin_values and decode_values.
std::vector<float> pca_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
void pca_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                       const BtfcQuery& query, std::uint32_t width, float* out);

std::vector<float> pcarf_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
void pcarf_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                         const BtfcQuery& query, std::uint32_t width, float* out);

std::vector<float> lpca_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query);
void lpca_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                        const BtfcQuery& query, std::uint32_t width, float* out);

}  // namespace btfc
