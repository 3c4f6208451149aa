// The steps that all readers take to read only what is asked for.
#pragma once
#include "encoder/image_reduction.h"
#include "encoder/input/dataset_read.h"

namespace btfc {

// The pairs to keep of a set with these directions.
Result<PairChoice> pairs_to_read(const DatasetReadOptions& options, const DatasetInfo& all);

// What becomes of images of this info, which has the cropped size and all channels; `path` is named in
// errors.
Result<ImageReduction> reduction_to_read(const DatasetReadOptions& options, const DatasetInfo& info,
                                         const std::string& path);
// The info of the images then.
DatasetInfo reduced_info(DatasetInfo info, const ImageReduction& reduction);
// The codes of one such image.
std::vector<std::uint16_t> reduced_codes(const DatasetInfo& info, std::vector<std::uint16_t> codes,
                                         const ImageReduction& reduction);

// Of a set that could not be read in parts: the chosen pairs, channels and texels.
Result<Dataset> reduced_dataset(Dataset whole, const DatasetReadOptions& options, const std::string& path);

}  // namespace btfc
