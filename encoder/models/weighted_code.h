// Eigenimages and weights -> coded rows, as models pca and pcarf store them.
#pragma once
#include <utility>

#include "encoder/linear/matrix.h"
#include "format/models/weighted_images.h"

namespace btfc {

// A column (texel, channel) -> a row a channel, texels in order.
CodedRows code_image(const Eigen::Ref<const Eigen::VectorXf>& column, std::size_t channels,
                     Precision precision);

// An eigenimage, and what its weights have to be multiplied by: the largest pixel becomes 1, so that half
// floats and bytes see the same range whatever the material. An image of zeros stays one.
std::pair<CodedRows, float> code_eigenimage(const Eigen::Ref<const Eigen::VectorXf>& column,
                                            std::size_t channels, Precision precision);

}  // namespace btfc
