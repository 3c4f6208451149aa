// Data sets as directories with the file names of UBO2003.
#pragma once
#include <string>

#include "encoder/dataset/dataset.h"
#include "format/result.h"

namespace btfc {

// "tv030_pv000/00083 tl015 pl060 tv030 pv000.png" for each pair; the number is light * views + view. Angles
// have decimals where they need them, six at most, so that reading gives the same directions within 1e-8
// radians, in order of theta, then phi. Integer codes of up to 4 channels are PNG, unchanged; halves are EXR,
// unchanged; more than 4 channels of integers are EXR too, and so come back as halves. EXR keeps the
// channels' names.
//
// Refused: two directions nearer than a millionth of a degree, and colours that the files cannot state (PNG
// is read as sRGB, EXR as linear Rec. 709). Quantity and wraps are not written.
//
// The directory appears whole or not at all: it is written beside the target under a hidden name, and
// renamed. An existing target must be an empty directory. Uses the threads of the calling oneTBB arena.
Result<Done> write_ubo2003(const std::string& path, const Dataset& dataset);

}  // namespace btfc
