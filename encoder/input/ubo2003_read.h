// Directories of images whose file names say light and view: UBO2003, ATRIUM, UTIA, SPECTRAL.
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// A directory with an image of such a name in it or below.
bool is_ubo2003(const std::string& path);

// JPEG, PNG, EXR and HDR files in the directory and below it, symbolic links to directories aside; the
// folders' names say nothing. The views and lights are the distinct directions of the names, in order of
// theta, then phi. Colours are as the files have them, but for UTIA's EXR, which are CIE XYZ under D65 by the
// publisher's word and no attribute: they become linear Rec. 709, in halves, so that all behind sees RGB;
// their scale stays.
// The quantity is unspecified: no publisher states it.
//
// UTIA's list of shifted lights is a text file whose rows are number, theta, phi, shifted theta, shifted phi
// in degrees: an image whose light is its view was lit from the shifted direction, which is then a light of
// its own. What is missing is told from the names alone.
Result<DatasetRead> read_ubo2003(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
