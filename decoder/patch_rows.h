// Model patch, the fast CPU paths: rows of rectangles as runs of single patches, and texels without
// divisions.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "format/loaded_item.h"

namespace btfc {

// See DecoderModel::make_tables. The reciprocal of the step; then for each map of three channels a copy of
// its sample without the padding of the plane, so that runs of texels are plain copies.
std::vector<std::uint64_t> patch_make_tables(const LoadedItem& item);

// See DecoderModel::decode_rows.
void patch_decode_rows(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                       std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
                       std::uint8_t* out, std::size_t row_stride);

// A map's sample in tightly packed texels, and where reading it must end.
struct PackedSample {
  const std::uint8_t *texels, *end;
};

// A rectangle and where it goes.
struct Rows {
  std::uint32_t x, y, width, height;
  std::uint8_t* out;
  std::size_t row_stride;
};

// See DecoderModel::decode_texels.
void patch_decode_texels(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                         const std::int32_t* texels, std::size_t count, std::uint8_t* out);

}  // namespace btfc
