// Many images of a data set in one picture, for looking at.
#pragma once
#include <cstdint>

#include "encoder/dataset/dataset.h"

namespace btfc {

// At most `most` pairs, evenly from the list, in rows from the top left, display-coded to 8 bits. Images
// above 256 texels a side are averaged down; `repeats` x `repeats` copies of each are laid side by side.
Image contact_sheet(const Dataset& dataset, std::size_t most, std::uint32_t repeats = 1);

}  // namespace btfc
