// Columns -> rows of channels.
#include "encoder/models/weighted_code.h"

namespace btfc {

CodedRows code_image(const Eigen::Ref<const Eigen::VectorXf>& column, std::size_t channels,
                     Precision precision) {
  const auto size = static_cast<std::size_t>(column.size()), texels = size / channels;
  std::vector<float> rows(size);
  for (std::size_t i = 0; i < size; ++i) rows[i % channels * texels + i / channels] = column(as_index(i));
  return code_rows(rows, channels, texels, precision);
}

std::pair<CodedRows, float> code_eigenimage(const Eigen::Ref<const Eigen::VectorXf>& column,
                                            std::size_t channels, Precision precision) {
  const float largest = column.cwiseAbs().maxCoeff();
  if (largest == 0) return {code_image(column, channels, precision), 0.0f};
  return {code_image(column / largest, channels, precision), largest};
}

}  // namespace btfc
