// Shapes of matrices in the file.
#include "encoder/input/ubo2014_factors.h"

#include <fmt/format.h>

namespace btfc {
namespace {

// The files of UBO2014 have about 100; the limit bounds the memory for a few rows.
constexpr std::uint32_t kMaxComponents = 65536;

}  // namespace

Ubo2014Matrix read_ubo2014_shape(Ubo2014Cursor& cursor, const std::string& what) {
  Ubo2014Matrix shape;
  shape.scalar_bytes = cursor.u8("the scalar size of " + what);
  shape.components = cursor.u32("the number of components of " + what);
  if (cursor.failed()) return shape;
  if (shape.scalar_bytes != 2 && shape.scalar_bytes != 4 && shape.scalar_bytes != 8) {
    cursor.refuse(fmt::format("{} has scalars of {} bytes, expected 2, 4 or 8", what, shape.scalar_bytes));
  } else if (shape.components < 1 || shape.components > kMaxComponents) {
    cursor.refuse(
        fmt::format("{} has {} components, expected 1 to {}", what, shape.components, kMaxComponents));
  }
  return shape;
}

Ubo2014Matrix skip_ubo2014_matrix(Ubo2014Cursor& cursor, const Ubo2014Matrix& shape, std::uint64_t rows,
                                  const std::string& what) {
  Ubo2014Matrix matrix = shape;
  matrix.rows = rows;
  matrix.offset = cursor.skip(CheckedSize(rows) * shape.components * shape.scalar_bytes, what);
  return matrix;
}

}  // namespace btfc
