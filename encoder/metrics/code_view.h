// Codes of an image seen as rows of display-coded grey or of linear colour: what the fast measures read.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/image.h"

namespace btfc {

// What channels mean to a measure of colour. none: spectral channels, data such as normals, and colour spaces
// whose primaries are not those of Rec. 709.
enum class ColourMeaning { none, grey, rgb };

// Of an image: one or two channels are grey, three or four RGB (alpha is ignored).
ColourMeaning colour_meaning(const Image& image);
// Of a data set: one channel is grey, three or four whose first are named R, G, B are RGB.
ColourMeaning colour_meaning(const DatasetInfo& info);

// Code -> value in [0, 1], made once for all images of a type and colour space.
struct CodeTables {
  std::vector<float> display;  // display_table
  std::vector<float> linear;   // the same through the sRGB curve: linear light
};
CodeTables code_tables(SampleType type, ColourSpace colour_space);

// Refers to codes and tables, which must outlive it.
struct CodeView {
  std::span<const std::uint16_t> codes;  // rows from the top, channels interleaved
  std::uint32_t width = 0, height = 0, channels = 0;
  ColourMeaning meaning = ColourMeaning::none;
  const CodeTables* tables = nullptr;

  // Display-coded grey of row y: Rec. 601 luma of RGB, the first channel of grey, else the mean of all.
  void grey_row(std::uint32_t y, std::span<float> grey) const;
  // Linear Rec. 709 of row y; grey as three equal channels. meaning is not none.
  void linear_row(std::uint32_t y, std::span<float> red, std::span<float> green, std::span<float> blue) const;
};
CodeView code_view(const Image& image, const CodeTables& tables);

}  // namespace btfc
