// A matrix too large to hold, read in blocks of rows; and sums over its blocks that no thread count changes.
#pragma once
#include <cstddef>
#include <functional>
#include <span>

#include "encoder/linear/matrix.h"

namespace btfc {

struct RowBlocks {
  std::size_t rows = 0, columns = 0, block_rows = 1;
  // Fills a matrix of (rows of the block) x columns. Called from many threads at once.
  std::function<void(std::size_t first_row, Matrix& block)> read;

  std::size_t count() const { return (rows + block_rows - 1) / block_rows; }
  std::size_t rows_of(std::size_t block) const { return std::min(block_rows, rows - block * block_rows); }
};

// The same with each column multiplied by the root of its weight, so that sums of squares over it are the
// weighted ones of `matrix`; none: `matrix` itself.
RowBlocks weighted_columns(RowBlocks matrix, std::span<const double> weights);

// Rows a block so that one takes some 8 MB.
std::size_t rows_per_block(std::size_t columns);

// Keeps BLAS to the calling thread; fits run their own threads. To be called before products are taken.
void use_blas_single_threaded();

// Calls work(block, its number, its place among the partial results 0 … kPartials-1) for all blocks in
// parallel, kPartials of them at a time, and fold(place) for each of these in order afterwards.
inline constexpr std::size_t kPartials = 4;
void for_each_block(
    const RowBlocks& matrix,
    const std::function<void(const Matrix& block, std::size_t number, std::size_t place)>& work,
    const std::function<void(std::size_t place)>& fold);

}  // namespace btfc
