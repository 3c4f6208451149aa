// Codes -> display codes by a table.
#include "encoder/tiling/display_codes.h"

#include <algorithm>
#include <cmath>

#include "encoder/metrics/display_values.h"

namespace btfc {

DisplayCodes::DisplayCodes(const DatasetInfo& info) {
  Image kind;  // display_table reads nothing but type and colour space
  kind.type = info.type;
  kind.colour_space = info.colour_space;
  for (const float v : display_table(kind))
    table_.push_back(static_cast<std::uint16_t>(std::lround(v * kOne)));
}

std::vector<std::uint16_t> DisplayCodes::image(const Dataset& dataset, std::size_t pair) const {
  std::vector<std::uint16_t> codes(dataset.info().image_samples());
  dataset.read_image(pair, codes);
  std::ranges::transform(codes, codes.begin(), [&](std::uint16_t code) { return table_[code]; });
  return codes;
}

}  // namespace btfc
