// SSIM of many images: the measure of compare_images, by rows and in single precision.
#pragma once
#include "encoder/metrics/code_view.h"

namespace btfc {

// Wang, Bovik, Sheikh, Simoncelli 2004 on grey_row: Gaussian window of 11x11, sigma 1.5, K1 0.01, K2 0.03,
// mean over the windows that lie inside. NaN where a side is below 11 texels. Both have the same size. Within
// 10^-5 of compare_images, which keeps whole planes of doubles.
double ssim_by_rows(const CodeView& a, const CodeView& b);

}  // namespace btfc
