// Data sets from BTF files of OpenEXR parts (spec/interchange.md).
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// An OpenEXR file whose first part has the attribute btfc:version. Other EXR files are images.
bool is_btf_exr(const std::string& path);

// Decodes parts on all threads of the calling oneTBB arena, a band of rows at a time; only chunks with rows
// of the crop are read. Half and float channels; float ones are rounded to half where the file does not call
// them unorm16. Refused: values that are not finite or beyond 65504, those that are no code where the file
// says there are codes, and lossy compression.
Result<DatasetRead> read_btf_exr(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
