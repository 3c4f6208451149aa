// Minimum error cuts through overlaps: of image quilting, of tiles.
#pragma once
#include <cstdint>
#include <vector>

namespace btfc {

struct Cut {
  std::vector<std::uint16_t>
      path;  // for each row the column, 0 … width-1, whose texel is the later patch's first
  std::uint64_t cost = 0;
};

// cost holds count rows of width costs. The path from the first to the last row with the least sum of costs,
// whose column changes by at most one from row to row (paper, Fig. 4). Of equal paths the leftmost is taken.
Cut minimum_error_cut(const std::vector<std::uint64_t>& cost, std::uint32_t width, std::uint32_t count);

// The same for a path that closes: the columns of the last and the first row, too, differ by at most one.
Cut minimum_error_closed_cut(const std::vector<std::uint64_t>& cost, std::uint32_t width,
                             std::uint32_t count);

// Squared errors of the overlap -> costs of cutting before each column. A cut lies between two texels, the
// last of the earlier patch and the first of the later one, and both may show it: the sum of their errors
// (Kwatra et al., Graphcut Textures, SIGGRAPH 2003, eq. 1, without the root). The paper charges one texel;
// its cuts show more. In place.
void costs_of_cutting(std::vector<std::uint64_t>& error, std::uint32_t width, std::uint32_t count);

}  // namespace btfc
