// A data set from one image file per pair of directions.
#pragma once
#include <functional>
#include <span>
#include <string>

#include "encoder/image_file.h"
#include "encoder/input/dataset_read.h"

namespace btfc {

// Changes the image of pair `number` after it was read and before it is cropped: codes, type and colour
// space, the latter two alike for all. Called from many threads at once.
using ImageEdit = std::function<Result<Done>(std::size_t number, ImageFile& named)>;

// info has directions, pairs and conventions; size, channels and sample type are those of the first image,
// and its colour space where info has none: linear Rec. 709 where a float image of R, G, B states nothing, as
// OpenEXR and Radiance have it. All images must agree in size, channels and type: the first that does not is
// named. Channels whose names are wavelengths are sorted by them and named by the plain number.
// paths[i] is the image of info.pairs[i]; those of pairs that the options leave out are not opened. Decodes
// on all threads of the calling oneTBB arena.
Result<Dataset> dataset_of_images(DatasetInfo info, std::span<const std::string> paths,
                                  const DatasetReadOptions& options, const ImageEdit& edit = {});

}  // namespace btfc
