// Model patch, fast rectangles: runs of texels that come from one patch are copied.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/loaded_item.h"

namespace btfc {

// See DecoderModel::decode_rows.
void patch_decode_rows(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                       std::uint32_t width, std::uint32_t height, std::uint8_t* out, std::size_t row_stride);

}  // namespace btfc
