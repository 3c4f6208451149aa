// Display-coded values of a data set as integers, so that sums of them do not depend on their order.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

class DisplayCodes {
 public:
  static constexpr double kOne = 4095;  // the code of the display value 1
  explicit DisplayCodes(const DatasetInfo& info);
  // All samples of a pair's image, 0 … 4095, in the order of its codes.
  std::vector<std::uint16_t> image(const Dataset& dataset, std::size_t pair) const;

 private:
  std::vector<std::uint16_t> table_;
};

}  // namespace btfc
