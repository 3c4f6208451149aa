// Radiance pictures (.hdr): RGBE texels under any order of the axes.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "format/result.h"

namespace btfc {

// Linear RGB radiance, rows from the top, channels interleaved.
struct RadianceImage {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;
};

// By the extension: .hdr or .rgbe in any case.
bool is_radiance(const std::string& path);

// Flat texels, old and new run lengths, all eight orders and signs of the axes; EXPOSURE is divided out.
// Refused: XYZE texels, damaged or short files, sides above 65536, more than 2^28 texels.
Result<RadianceImage> read_radiance(const std::string& path);

}  // namespace btfc
