// Many images of a data set in one picture, for looking at.
#pragma once
#include <cstdint>

#include "encoder/dataset/dataset.h"

namespace btfc {

// At most `most` pairs, evenly from the list, in rows from the top left, display-coded to 8 bits. Images
// above 256 texels a side are averaged down; `repeats` x `repeats` copies of each are laid side by side.
Image contact_sheet(const Dataset& dataset, std::size_t most, std::uint32_t repeats = 1);

// Two data sets of the same size and pairs: at most `most` pairs, from the steepest to the most grazing ones,
// side by side, `a` above `b`. Small images are magnified.
Image comparison_sheet(const Dataset& a, const Dataset& b, std::size_t most);

}  // namespace btfc
