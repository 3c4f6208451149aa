// Dynamic programming over the overlap, row by row.
#include "encoder/minimum_cut.h"

#include <algorithm>
#include <cstddef>

namespace btfc {

void costs_of_cutting(std::vector<std::uint64_t>& error, std::uint32_t width, std::uint32_t count) {
  for (std::uint32_t row = 0; row < count; ++row) {
    std::uint64_t* e = &error[std::size_t{row} * width];
    for (std::uint32_t c = width - 1; c > 0; --c) e[c] += e[c - 1];
    e[0] *= 2;  // the earlier texel lies outside the overlap, where both are not known
  }
}

namespace {

constexpr std::uint64_t kNever = UINT64_MAX / 2;  // two of them do not overflow

// The path among those that begin in columns first … last.
Cut cut_from(const std::vector<std::uint64_t>& cost, std::uint32_t width, std::uint32_t count,
             std::uint32_t first_begin, std::uint32_t last_begin, std::uint32_t first_end,
             std::uint32_t last_end) {
  std::vector<std::uint64_t> sum(cost.begin(),
                                 cost.begin() + static_cast<std::ptrdiff_t>(std::size_t{width} * count));
  for (std::uint32_t c = 0; c < width; ++c) {
    if (c < first_begin || c > last_begin) sum[c] = kNever;
  }
  for (std::uint32_t row = 1; row < count; ++row) {
    const std::uint64_t* before = &sum[std::size_t{row - 1} * width];
    std::uint64_t* here = &sum[std::size_t{row} * width];
    for (std::uint32_t c = 0; c < width; ++c) {
      const std::uint32_t first = c == 0 ? 0 : c - 1, last = std::min(c + 1, width - 1);
      here[c] = std::min(kNever, here[c] + *std::min_element(before + first, before + last + 1));
    }
  }
  Cut out;
  out.path.resize(count);
  const std::uint64_t* row = &sum[std::size_t{count - 1} * width];
  auto c = static_cast<std::uint32_t>(std::min_element(row + first_end, row + last_end + 1) - row);
  out.cost = row[c];
  out.path[count - 1] = static_cast<std::uint16_t>(c);
  for (std::uint32_t r = count - 1; r-- > 0;) {
    row = &sum[std::size_t{r} * width];
    const std::uint32_t first = c == 0 ? 0 : c - 1, last = std::min(c + 1, width - 1);
    c = static_cast<std::uint32_t>(std::min_element(row + first, row + last + 1) - row);
    out.path[r] = static_cast<std::uint16_t>(c);
  }
  return out;
}

}  // namespace

Cut minimum_error_cut(const std::vector<std::uint64_t>& cost, std::uint32_t width, std::uint32_t count) {
  return cut_from(cost, width, count, 0, width - 1, 0, width - 1);
}

Cut minimum_error_closed_cut(const std::vector<std::uint64_t>& cost, std::uint32_t width,
                             std::uint32_t count) {
  Cut best;
  best.cost = UINT64_MAX;
  for (std::uint32_t c = 0; c < width; ++c) {
    Cut one = cut_from(cost, width, count, c, c, c == 0 ? 0 : c - 1, std::min(c + 1, width - 1));
    if (one.cost < best.cost) best = std::move(one);
  }
  return best;
}

}  // namespace btfc
