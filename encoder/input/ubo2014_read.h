// Data sets from the University of Bonn's .btf files, UBO2014's among them.
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// By the signature, whatever the file's name.
bool is_ubo2014(const std::string& path);

// DFMF, FMF, PVF and BDI bodies. The data set is float16 and linear, with all pairs of the file's directions;
// it does not repeat (the format does not say). quantity follows the file's cosine flag. Values are as
// stored: nothing is clamped, and the cosine is not divided out. Rows run from the top and angles are taken
// as the material's frame has them, as the authors' reader does. Only cropped texels are computed.
Result<DatasetRead> read_ubo2014(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
