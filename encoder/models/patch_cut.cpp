// Dynamic programming over the overlap, row by row.
#include "encoder/models/patch_cut.h"

#include <algorithm>
#include <cstddef>

namespace btfc {

std::vector<std::uint16_t> minimum_error_cut(const std::vector<std::uint64_t>& error, std::uint32_t width,
                                             std::uint32_t count) {
  std::vector<std::uint64_t> sum(error.begin(),
                                 error.begin() + static_cast<std::ptrdiff_t>(std::size_t{width} * count));
  for (std::uint32_t row = 1; row < count; ++row) {
    const std::uint64_t* before = &sum[std::size_t{row - 1} * width];
    std::uint64_t* here = &sum[std::size_t{row} * width];
    for (std::uint32_t c = 0; c < width; ++c) {
      const std::uint32_t first = c == 0 ? 0 : c - 1, last = std::min(c + 1, width - 1);
      here[c] += *std::min_element(before + first, before + last + 1);
    }
  }
  std::vector<std::uint16_t> path(count);
  const std::uint64_t* row = &sum[std::size_t{count - 1} * width];
  std::uint32_t c = static_cast<std::uint32_t>(std::min_element(row, row + width) - row);
  path[count - 1] = static_cast<std::uint16_t>(c);
  for (std::uint32_t r = count - 1; r-- > 0;) {
    row = &sum[std::size_t{r} * width];
    const std::uint32_t first = c == 0 ? 0 : c - 1, last = std::min(c + 1, width - 1);
    c = static_cast<std::uint32_t>(std::min_element(row + first, row + last + 1) - row);
    path[r] = static_cast<std::uint16_t>(c);
  }
  return path;
}

}  // namespace btfc
