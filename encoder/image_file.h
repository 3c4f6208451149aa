// Images from and to files through OpenImageIO.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

// An image and the names of its channels, "R", "G", "B", "550.5", …, as the file has them.
struct ImageFile {
  Image image;
  std::vector<std::string> channels;
};

// PNG, JPEG, TIFF, EXR, HDR (under any order of its axes) and what else OpenImageIO reads. 8-bit files give
// unorm8, 16-bit unorm16, half and float ones float16. One to max_channels channels; alpha stays as the file
// has it. Refused: NaN and infinity, values beyond +-65504 (with the first one's place and their number),
// other channel counts and sample types, files that end early. Values between float and half are rounded to
// nearest, ties to even. Thread-safe.
Result<ImageFile> read_image_file(const std::string& path, std::uint32_t max_channels = 4);
Result<Image> read_image(const std::string& path, std::uint32_t max_channels = 4);

// What write_image_rows needs to know before the first row.
struct ImageHeader {
  std::uint32_t width = 0, height = 0, channels = 0;
  SampleType type = SampleType::unorm8;
  ColourSpace colour_space = ColourSpace::unknown;
  Alpha alpha = Alpha::none;
  std::vector<std::string> channel_names = {};  // for EXR; empty: R, G, B, A, …
};

// Fills `count` rows from row y with codes of the header's type: 1 byte a sample for unorm8, 2 for the
// others.
using RowSource = std::function<Result<Done>(std::uint32_t y, std::uint32_t count, std::uint8_t* codes)>;

// Writes PNG (unorm8, unorm16 codes unchanged) or EXR (float16 unchanged, unorm8 as half, unorm16 as float)
// in bands, so that the image is never held whole. float16 goes to PNG as 8 bits, sRGB-coded where its colour
// space is linear: for looking at, not for exchange. The file appears whole or not at all.
Result<Done> write_image_rows(const std::string& path, const ImageHeader& header, const RowSource& rows);

// channel_names as in ImageHeader.
Result<Done> write_image(const std::string& path, const Image& image,
                         const std::vector<std::string>& channel_names = {});

}  // namespace btfc
