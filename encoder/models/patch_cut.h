// The minimum error boundary cut of image quilting.
#pragma once
#include <cstdint>
#include <vector>

namespace btfc {

// error holds count rows of width squared errors. Returns, for each row, the column of the path from the
// first to the last row with the least sum of errors, whose column changes by at most one from row to row
// (paper, Fig. 4). Of equal paths the leftmost is taken. Entries are 0 … width-1: the path's texel belongs to
// the later patch.
std::vector<std::uint16_t> minimum_error_cut(const std::vector<std::uint64_t>& error, std::uint32_t width,
                                             std::uint32_t count);

}  // namespace btfc
