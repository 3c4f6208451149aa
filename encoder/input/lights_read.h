// Reflectance fields: photographs from one view under many known lights (RTI, photometric stereo).
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// An .lp file, or a directory with one, with light_directions.txt, or with lights.txt in it or beside it.
bool is_lights(const std::string& path);

// One view at theta 0, the lights in the order of their file. Images lie beside the .lp file or in the
// directory. They are found by the .lp file's base names or those of filenames.txt (Windows paths too, in any
// case), and where none of these is there, or there are no names, in natural order if there are as many as
// lights; images with "mask" in their name are passed over.
//
// light_intensities.txt beside the images (DiLiGenT) gives each light's intensity a channel: the samples are
// divided by it and become halves, as all users of that set begin with; the colours are then linear Rec. 709.
// Else samples stay as they are. The lights' cosine is in the photographs: the quantity is reflectance_cos.
Result<DatasetRead> read_lights(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
