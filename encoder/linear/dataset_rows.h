// A data set as matrices whose rows are read in blocks.
#pragma once
#include <memory>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/linear/row_blocks.h"

namespace btfc {

// Values of codes, by code.
std::vector<float> value_table(SampleType type);

// Row (texel, channel) = texel * channels + channel, texels in rows from the top; columns: all pairs. Each
// row less its mean by the pairs' weights (the mean image), where centred. The data set must outlive the
// result.
RowBlocks image_rows(const Dataset& dataset, bool centred);

// Row: a texel; columns: pair * channels + channel: the texel's apparent BRDF.
RowBlocks abrdf_rows(const Dataset& dataset);

// The weights of abrdf_rows' columns; none where the data set has none.
std::vector<double> abrdf_weights(const DatasetInfo& info);

// The mean over pairs by their weights: value (texel, channel) at texel * channels + channel. Two-pass, in
// double.
std::vector<float> mean_image(const Dataset& dataset);

}  // namespace btfc
