// Files that list the lights of a stack of photographs.
#pragma once
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "format/result.h"

namespace btfc {

// x to the image's right, y to its top, z to the camera. names: as the file has them, one a light; empty
// where it names no images.
struct LightList {
  std::vector<Direction> directions;
  std::vector<std::string> names;
};

// 1 … 10000 lights, each longer than 1e-4, not below the surface, no two alike; else an error that names line
// or light.
//
// RTI's .lp: the number of images, then a line "name x y z" each, where the name may hold blanks and be
// absent in all lines alike.
Result<LightList> read_lp(const std::string& path);
// A table of numbers: a count and then x y z a line (University of Washington), x y z a line (DiLiGenT), or
// three lines of all x, all y, all z (PSBox).
Result<LightList> read_light_table(const std::string& path);

// One row of positive numbers a light: its intensity in each channel.
Result<std::vector<std::vector<double>>> read_light_intensities(const std::string& path, std::size_t lights);

}  // namespace btfc
