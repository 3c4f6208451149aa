// Rows of model patch. Outside the overlap with the row above, a row is a sequence of runs of single patches
// (quilting: the vertical cut ends one run and begins the next); the rest goes through the shared header.
#include "decoder/patch_rows.h"

#include <algorithm>
#include <cstring>

#include "decoder/model_table.h"
#include "shaders/models/patch.h"

namespace btfc {
namespace {

// One row of one map, while it is written.
template <class Sample>
struct Row {
  const BtfcWords& words;
  const PatchParams& p;
  const std::uint8_t* plane;  // the sample's padded texels
  std::uint32_t channels, padded;
  std::uint32_t y, j, v;
  Sample* out;  // texel x0 of the row
  std::uint32_t x0;

  void texel(std::uint32_t x) const {
    const uvec4 codes = patch_codes(words, p, x, y);
    Sample* to = out + std::size_t{x - x0} * channels;
    for (std::uint32_t c = 0; c < channels; ++c) to[c] = static_cast<Sample>(codes[static_cast<int>(c)]);
  }

  // Texels [x, end) of the row, all shown by patch (i, j), whose left edge lies at `left`.
  void run(std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t left) const {
    if (x >= end) return;
    const uvec2 at = patch_coordinates(words, p, i, j);
    const std::size_t first = std::size_t{at.y + v} * p.sample_width + at.x + (x - left);
    Sample* to = out + std::size_t{x - x0} * channels;
    const std::size_t count = end - x;
    if (channels == padded) {
      std::memcpy(to, plane + first * padded * sizeof(Sample), count * padded * sizeof(Sample));
      return;
    }
    const Sample* from = reinterpret_cast<const Sample*>(plane) + first * padded;
    for (std::size_t q = 0; q < count; ++q) {  // RGB: four stored, three wanted
      to[3 * q] = from[4 * q];
      to[3 * q + 1] = from[4 * q + 1];
      to[3 * q + 2] = from[4 * q + 2];
    }
  }
};

template <class Sample>
void decode_row(const Row<Sample>& row, std::uint32_t x, std::uint32_t end) {
  const PatchParams& p = row.p;
  const std::uint32_t step = p.patch_size - p.overlap;
  const bool in_above = (row.j > 0 || p.wraps == 1) && row.v < p.overlap;
  while (x < end) {
    const std::uint32_t i = std::min(x / step, p.patch_count_x - 1);
    const std::uint32_t left = i * step;
    const std::uint32_t stop = std::min(end, i + 1 == p.patch_count_x ? end : left + step);
    const bool has_left = i > 0 || p.wraps == 1;
    const std::uint32_t overlap_end = std::min(stop, has_left ? left + p.overlap : left);
    if (in_above) {
      for (; x < stop; ++x) row.texel(x);
      continue;
    }
    if (x < overlap_end) {
      if (p.blend == PATCH_QUILTING) {
        const std::uint32_t cut =
            std::clamp(left + patch_cut_v(row.words, p, i, row.j, row.v), x, overlap_end);
        row.run(x, cut, i > 0 ? i - 1 : p.patch_count_x - 1, left - step);
        row.run(cut, overlap_end, i, left);
        x = overlap_end;
      } else {
        for (; x < overlap_end; ++x) row.texel(x);
      }
    }
    row.run(x, stop, i, left);
    x = stop;
  }
}

template <class Sample>
void decode_rows(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                 std::uint32_t width, std::uint32_t height, std::uint8_t* out, std::size_t row_stride) {
  const BtfcWords words = words_of(item);
  PatchParams p;
  std::memcpy(&p, item.map_params[map].data(), sizeof p);
  const auto* plane = reinterpret_cast<const std::uint8_t*>(words.slot[PATCH_SAMPLE] + p.plane_word);
  const std::uint32_t channels = item.head.maps[map].channels;
  const auto padded = static_cast<std::uint32_t>(p.texel_bits / (8 * sizeof(Sample)));
  const std::uint32_t step = p.patch_size - p.overlap;
  for (std::uint32_t r = 0; r < height; ++r) {
    const std::uint32_t j = std::min((y + r) / step, p.patch_count_y - 1);
    const Row<Sample> row{words,
                          p,
                          plane,
                          channels,
                          padded,
                          y + r,
                          j,
                          y + r - j * step,
                          reinterpret_cast<Sample*>(out + r * row_stride),
                          x};
    decode_row(row, x, x + width);
  }
}

}  // namespace

void patch_decode_rows(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                       std::uint32_t width, std::uint32_t height, std::uint8_t* out, std::size_t row_stride) {
  if (item.head.maps[map].type == SampleType::unorm8) {
    decode_rows<std::uint8_t>(item, map, x, y, width, height, out, row_stride);
  } else {
    decode_rows<std::uint16_t>(item, map, x, y, width, height, out, row_stride);
  }
}

}  // namespace btfc
