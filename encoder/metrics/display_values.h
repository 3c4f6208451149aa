// Codes as a display shows them: what all measures between images work on.
#pragma once
#include <vector>

#include "encoder/image.h"

namespace btfc {

// Code -> display-coded value in [0, 1]: integer codes as they are, float16 through the sRGB curve unless the
// map holds data. Not rounded to 8 bits; NaN is 0.
std::vector<float> display_table(SampleType type, ColourSpace colour_space);
std::vector<float> display_table(const Image& image);

// Rec. 601 luma of display-coded values for three channels and more, the first channel otherwise.
std::vector<double> luma(const Image& image, const std::vector<float>& display);

}  // namespace btfc
