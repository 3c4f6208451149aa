// DFMF: each decorrelated colour channel is a matrix of images, factored by an SVD.
#include <fmt/format.h>

#include <cmath>

#include "encoder/input/ubo2014_factors.h"

namespace btfc {
namespace {

Ubo2014Colour read_colour(Ubo2014Cursor& cursor, const Ubo2014Header& header) {
  Ubo2014Colour colour;
  const auto number = static_cast<std::int32_t>(cursor.u32("the colour model"));
  for (float& each : colour.mean) each = cursor.f32("the colour mean");
  for (float& each : colour.matrix) each = cursor.f32("the colour matrix");
  if (cursor.failed()) return colour;
  const Ubo2014ColourChoice choice = choose_ubo2014_colour(number, header.channels.size());
  if (!choice.fault.empty()) cursor.refuse_unsupported(choice.fault);
  colour.coding = choice.coding;
  return colour;
}

Ubo2014Factors read_channel(Ubo2014Cursor& cursor, Ubo2014Header& header, std::size_t number) {
  const std::string what = fmt::format("channel {}", number);
  Ubo2014Factors factors;
  const Ubo2014Matrix shape = read_ubo2014_shape(cursor, what);
  const std::uint64_t rows = cursor.u32("the rows of " + what),
                      columns = cursor.u32("the columns of " + what);
  if (cursor.failed()) return factors;
  const bool pairs_first = rows == header.pairs() && columns == header.texels();
  const bool texels_first = rows == header.texels() && columns == header.pairs();
  if (!pairs_first && !texels_first) {
    cursor.refuse(fmt::format("{} is a matrix of {} rows and {} columns, expected {} images and {} texels",
                              what, rows, columns, header.pairs(), header.texels()));
    return factors;
  }
  if (pairs_first && texels_first && rows > 1 && number == 0) {
    header.notes.push_back("there are as many images as texels: a matrix's rows are taken as images");
  }
  // Already multiplied into the right factor.
  skip_ubo2014_matrix(cursor, shape, 1, "the singular values of " + what);
  const Ubo2014Matrix u = skip_ubo2014_matrix(cursor, shape, rows, "U of " + what);
  const Ubo2014Matrix sxv = skip_ubo2014_matrix(cursor, shape, columns, "SxV of " + what);
  factors.directions.matrix = pairs_first ? u : sxv;
  factors.texels.matrix = pairs_first ? sxv : u;
  return factors;
}

}  // namespace

Ubo2014Factored read_ubo2014_dfmf(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  Ubo2014Factored body;
  cursor.u32("the number of components");  // the largest of the channels'
  body.colour = read_colour(cursor, header);
  for (std::size_t c = 0; c < header.channels.size() && !cursor.failed(); ++c) {
    body.factors.push_back(read_channel(cursor, header, c));
  }
  return body;
}

}  // namespace btfc
