// Sums of weighted rows: one loop that serves both directions of separable filters.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace btfc {

// out[i] = sum over t of taps[t] * rows[t][i], i < out.size(). Down a column rows are those of an image,
// along a row they are one row at successive offsets.
void weigh_rows(std::span<const float> taps, std::span<const float* const> rows, std::span<float> out);

// The same with rows[t] = first + t: a row filtered along itself, where it has out.size() + taps.size() - 1
// values.
void filter_along(std::span<const float> taps, const float* first, std::span<float> out);

// The last `rows` rows of `width` values, by the number of the row.
class RowRing {
 public:
  RowRing(std::size_t rows, std::size_t width) : rows_(rows), width_(width), values_(rows * width) {}
  std::span<float> row(std::size_t y) { return std::span(values_).subspan(y % rows_ * width_, width_); }

 private:
  std::size_t rows_, width_;
  std::vector<float> values_;
};

}  // namespace btfc
