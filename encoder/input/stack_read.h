// Data sets that a JSON file describes: images with any directions.
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// A regular file whose name ends in .json.
bool is_stack(const std::string& path);

// The description is one JSON object (RFC 8259) with these members and no others:
//   "images"        required: an array of one object an image, in any order
//     "file"          required: its path, relative to the description's folder unless it begins with /
//     "view"          [theta, phi] in degrees: theta 0 … 90 from the surface's normal, phi from the image's
//     right
//                     towards its top
//     "view_vector"   [x, y, z] instead: to the image's right, to its top, along the normal; of any length
//     above
//                     0.0001, z not below 0
//     "light", "light_vector"   likewise
//   "colour_space"  one of unknown, srgb_rec709_scene, lin_rec709_scene, lin_ap0_scene, lin_ap1_scene,
//                   lin_ciexyzd65_scene, data; absent or unknown: what the images state
//   "quantity"      one of unspecified (default), reflectance, reflectance_cos (the light's cosine is
//   multiplied
//                   in), radiance, data
//   "wraps"         whether the tile repeats without seams, default false
// An image has exactly one of view and view_vector, and one of light and light_vector. Directions are told
// apart to a millionth of a degree. No two images have the same pair; pairs may be missing, without
// skip_missing too.
Result<DatasetRead> read_stack(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
