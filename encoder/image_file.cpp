// Image files: the library that does it is loaded when the first is asked for.
#include "encoder/image_file.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <utility>

#include "encoder/oiio/image_module.h"
#include "encoder/output/png_bytes.h"

namespace btfc {
namespace {

struct Loaded {
  const ImageModule* module = nullptr;
  std::string why;  // there is none
};

// Where it lies is the program's to know: its run path leads there. Never unloaded.
const Loaded& loaded() {
  static const Loaded kLoaded = [] {
    void* library = dlopen(BTFC_IMAGE_MODULE, RTLD_LAZY | RTLD_LOCAL);
    void* entry = library != nullptr ? dlsym(library, "btfc_image_module") : nullptr;
    if (entry == nullptr) return Loaded{nullptr, dlerror()};
    return Loaded{reinterpret_cast<const ImageModule* (*)()>(entry)(), {}};
  }();
  return kLoaded;
}

Error missing() {
  return Error{
      Status::failed,
      fmt::format("no image can be read or written: the library that does it is missing: {}", loaded().why),
      "", 0};
}

}  // namespace

Result<ImageFile> read_image_file(const std::string& path, std::uint32_t max_channels) {
  const ImageModule* module = loaded().module;
  return module != nullptr ? module->read(path, max_channels) : missing();
}

Result<Image> read_image(const std::string& path, std::uint32_t max_channels) {
  Result<ImageFile> named = read_image_file(path, max_channels);
  if (!named) return named.error();
  return std::move(named->image);
}

Result<Done> write_image_rows(const std::string& path, const ImageHeader& header, const RowSource& rows) {
  const ImageModule* module = loaded().module;
  return module != nullptr ? module->write_rows(path, header, rows) : missing();
}

Result<Done> write_image(const std::string& path, const Image& image,
                         const std::vector<std::string>& channel_names) {
  const ImageHeader header{image.width,        image.height, image.channels, image.type,
                           image.colour_space, image.alpha,  channel_names};
  return write_image_rows(path, header,
                          [&](std::uint32_t y, std::uint32_t count, std::uint8_t* out) -> Result<Done> {
                            const std::size_t begin = image.index(0, y, 0),
                                              samples = std::size_t{count} * image.width * image.channels;
                            for (std::size_t i = 0; i < samples; ++i) {
                              const std::uint16_t code = image.codes[begin + i];
                              if (image.type == SampleType::unorm8) {
                                out[i] = static_cast<std::uint8_t>(code);
                              } else {
                                store_u16(out + 2 * i, code);
                              }
                            }
                            return Done{};
                          });
}

Result<Bytes> png_bytes(const Image& image) {
  const ImageModule* module = loaded().module;
  return module != nullptr ? module->png(image) : missing();
}

}  // namespace btfc
