// The library's only way in.
#include "encoder/oiio/image_module.h"

extern "C" __attribute__((visibility("default"))) const btfc::ImageModule* btfc_image_module();

const btfc::ImageModule* btfc_image_module() {
  static constexpr btfc::ImageModule kModule{btfc::oiio_read, btfc::oiio_write_rows, btfc::oiio_png};
  return &kModule;
}
