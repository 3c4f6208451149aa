// FMF: images of all channels are one matrix, factored by an SVD.
#include <fmt/format.h>

#include "encoder/input/ubo2014_factors.h"

namespace btfc {
namespace {

// Reduced dynamic range, and the height map that the images may be resampled to.
void read_extension(Ubo2014Cursor& cursor, Ubo2014Header& header, Ubo2014Factored& body) {
  const unsigned version = cursor.u8("the FMF header");
  if (version > 2) {
    cursor.refuse_unsupported(fmt::format("an FMF header of version {}, expected 0 to 2", version));
  }
  if (version >= 1 && cursor.u32("the dynamic range method") != 0) {
    body.colour.coding = Ubo2014ColourCoding::log;
  }
  if (version < 2) return;
  const std::uint32_t width = cursor.u32("the height map"), height = cursor.u32("the height map");
  cursor.skip(CheckedSize(width) * height * 2, "the height map");
  if (!cursor.failed() && width > 0 && height > 0) {
    header.notes.push_back(fmt::format("a height map of {}x{} texels is left out", width, height));
  }
}

}  // namespace

Ubo2014Factored read_ubo2014_fmf(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  Ubo2014Factored body;
  if (header.extended) read_extension(cursor, header, body);
  cursor.u32("the number of components");  // again below
  const Ubo2014Matrix shape = read_ubo2014_shape(cursor, "the factorisation");
  const std::uint64_t rows = cursor.u32("the rows"), columns = cursor.u32("the columns");
  if (cursor.failed()) return body;
  const std::uint64_t channels = header.channels.size(), pairs = header.pairs(), texels = header.texels();
  const bool pairs_first = rows == pairs * channels && columns == texels;
  const bool texels_first = rows == texels * channels && columns == pairs;
  if (!pairs_first && !texels_first) {
    cursor.refuse(fmt::format(
        "the factorisation has {} rows and {} columns, expected {} images and {} texels of {} channels", rows,
        columns, pairs, texels, channels));
    return body;
  }
  if (pairs_first && texels_first && texels > 1) {
    header.notes.push_back("there are as many images as texels: the matrix's rows are taken as images");
  }
  skip_ubo2014_matrix(cursor, shape, 1, "the singular values");
  const Ubo2014Matrix u = skip_ubo2014_matrix(cursor, shape, rows, "U");
  const Ubo2014Matrix sxv = skip_ubo2014_matrix(cursor, shape, columns, "SxV");
  // Channels run fastest in the rows of U.
  for (std::uint64_t c = 0; c < channels; ++c) {
    Ubo2014Factors factors;
    factors.directions = pairs_first ? Ubo2014Rows{u, c, channels} : Ubo2014Rows{sxv, 0, 1};
    factors.texels = pairs_first ? Ubo2014Rows{sxv, 0, 1} : Ubo2014Rows{u, c, channels};
    body.factors.push_back(factors);
  }
  return body;
}

}  // namespace btfc
