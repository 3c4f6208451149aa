// Factored BTFs: which rows of which matrices in the file are multiplied for a value.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/input/ubo2014_colour.h"
#include "encoder/input/ubo2014_file.h"
#include "encoder/input/ubo2014_header.h"
#include "format/result.h"

namespace btfc {

// A matrix in the file, row-major; its bytes lie within the file.
struct Ubo2014Matrix {
  std::uint64_t offset = 0;        // bytes, at any alignment
  std::uint32_t scalar_bytes = 2;  // 2 half, 4 float, 8 double
  std::uint64_t rows = 0;
  std::uint32_t components = 0;  // columns
};

// Every stride-th row from `first` on.
struct Ubo2014Rows {
  Ubo2014Matrix matrix;
  std::uint64_t first = 0, stride = 1;

  std::uint64_t offset(std::uint64_t i) const {
    return matrix.offset + (first + i * stride) * matrix.components * matrix.scalar_bytes;
  }
};

// value(direction, texel) = sum over k of directions[direction][k] * texels[texel][k], plus the mean: a
// column vector, by direction or by texel.
struct Ubo2014Factors {
  Ubo2014Rows directions, texels;
  enum class Mean { none, of_direction, of_texel } has_mean = Mean::none;
  Ubo2014Rows mean;
};

// Directions of group 0 are the pairs of views and lights, lights running fastest; where there is a group a
// view, they are its lights. Texels run along rows, from the top.
struct Ubo2014Factored {
  bool group_a_view = false;
  std::vector<Ubo2014Factors> factors;  // [group * channels + channel]
  Ubo2014Colour colour;
};

// The body behind the header. The matrices fit the header and fill the file to its end. Faults are the
// cursor's; notes go to the header.
Ubo2014Factored read_ubo2014_dfmf(Ubo2014Cursor& cursor, Ubo2014Header& header);
Ubo2014Factored read_ubo2014_fmf(Ubo2014Cursor& cursor, Ubo2014Header& header);
Ubo2014Factored read_ubo2014_pvf(Ubo2014Cursor& cursor, Ubo2014Header& header);

// What the bodies share: scalar size and component count as a factorisation begins, and a matrix.
Ubo2014Matrix read_ubo2014_shape(Ubo2014Cursor& cursor, const std::string& what);
Ubo2014Matrix skip_ubo2014_matrix(Ubo2014Cursor& cursor, const Ubo2014Matrix& shape, std::uint64_t rows,
                                  const std::string& what);

}  // namespace btfc
