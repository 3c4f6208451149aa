// Blocks in parallel, results in order.
#include "encoder/linear/row_blocks.h"

#include <cblas.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace btfc {

RowBlocks weighted_columns(RowBlocks matrix, std::span<const double> weights) {
  if (weights.empty()) return matrix;
  Eigen::RowVectorXf roots(as_index(weights.size()));
  for (std::size_t i = 0; i < weights.size(); ++i)
    roots(as_index(i)) = static_cast<float>(std::sqrt(weights[i]));
  matrix.read = [read = std::move(matrix.read), roots = std::move(roots)](std::size_t first_row,
                                                                          Matrix& block) {
    read(first_row, block);
    block.array().rowwise() *= roots.array();
  };
  return matrix;
}

std::size_t rows_per_block(std::size_t columns) {
  constexpr std::size_t kValues = 1 << 21;
  return std::clamp<std::size_t>(kValues / columns, 1, 4096);
}

void use_blas_single_threaded() {
  static const bool done = [] {
    openblas_set_num_threads(1);
    return true;
  }();
  static_cast<void>(done);
}

void for_each_block(const RowBlocks& matrix,
                    const std::function<void(const Matrix&, std::size_t, std::size_t)>& work,
                    const std::function<void(std::size_t)>& fold) {
  use_blas_single_threaded();
  std::array<Matrix, kPartials> blocks;
  for (std::size_t first = 0; first < matrix.count(); first += kPartials) {
    const std::size_t some = std::min(kPartials, matrix.count() - first);
    tbb::parallel_for(std::size_t{0}, some, [&](std::size_t place) {
      const std::size_t number = first + place;
      blocks[place].resize(as_index(matrix.rows_of(number)), as_index(matrix.columns));
      matrix.read(number * matrix.block_rows, blocks[place]);
      work(blocks[place], number, place);
    });
    for (std::size_t place = 0; place < some; ++place) fold(place);
  }
}

}  // namespace btfc
