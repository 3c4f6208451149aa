// What is done through OpenImageIO, as a library of its own that is loaded with the first picture:
// OpenImageIO brings two hundred others, half a second to start, and most of what the command does is without
// pictures.
#pragma once
#include <cstdint>
#include <string>

#include "encoder/image_file.h"
#include "format/bytes.h"

namespace btfc {

// See image_file.h and output/png_bytes.h.
struct ImageModule {
  Result<ImageFile> (*read)(const std::string& path, std::uint32_t max_channels);
  Result<Done> (*write_rows)(const std::string& path, const ImageHeader& header, const RowSource& rows);
  Result<Bytes> (*png)(const Image& image);
};

// Inside the library.
Result<ImageFile> oiio_read(const std::string& path, std::uint32_t max_channels);
Result<Done> oiio_write_rows(const std::string& path, const ImageHeader& header, const RowSource& rows);
Result<Bytes> oiio_png(const Image& image);

}  // namespace btfc
