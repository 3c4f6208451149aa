// Codes -> display codes by a table.
#include "encoder/tiling/display_codes.h"

#include <algorithm>
#include <cmath>

#include "encoder/metrics/display_values.h"

namespace btfc {

DisplayCodes::DisplayCodes(const DatasetInfo& info) {
  for (const float v : display_table(info.type, info.colour_space)) {
    table_.push_back(static_cast<std::uint16_t>(std::lround(v * kOne)));
  }
}

std::vector<std::uint16_t> DisplayCodes::image(const Dataset& dataset, std::size_t pair) const {
  std::vector<std::uint16_t> codes(dataset.info().image_samples());
  dataset.read_image(pair, codes);
  std::ranges::transform(codes, codes.begin(), [&](std::uint16_t code) { return table_[code]; });
  return codes;
}

}  // namespace btfc
