// PNG files in memory, as image files are written.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <memory>

#include "encoder/oiio/image_module.h"

namespace btfc {

Result<Bytes> oiio_png(const Image& image) {
  const OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height),
                             static_cast<int>(image.channels), OIIO::TypeDesc::UINT8);
  Bytes file;
  OIIO::Filesystem::IOVecOutput proxy(file);
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("memory.png");
  if (output) output->set_ioproxy(&proxy);
  const Bytes codes(image.codes.begin(), image.codes.end());
  if (!output || !output->open("memory.png", spec) ||
      !output->write_image(OIIO::TypeDesc::UINT8, codes.data()) || !output->close()) {
    return Error{Status::failed,
                 fmt::format("could not make a PNG: {}", output ? output->geterror() : OIIO::geterror()), "",
                 0};
  }
  return file;
}

}  // namespace btfc
