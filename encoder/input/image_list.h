// A data set from one image file per pair of directions.
#pragma once
#include <span>
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// info has directions, pairs and conventions; size, channels and sample type are those of the first image,
// and its colour space where info has none. All images must agree in them: the first that does not is named.
// paths[i] is the image of info.pairs[i]. Decodes on all threads of the calling oneTBB arena.
Result<Dataset> dataset_of_images(DatasetInfo info, std::span<const std::string> paths,
                                  const DatasetReadOptions& options);

}  // namespace btfc
