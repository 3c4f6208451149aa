// The list of formats, and the choice among them.
#include "encoder/input/dataset_read.h"

#include <fmt/format.h>

#include <array>

#include "encoder/input/btf_exr_read.h"
#include "encoder/input/dataset_format.h"
#include "encoder/input/lights_read.h"
#include "encoder/input/relight_read.h"
#include "encoder/input/stack_read.h"
#include "encoder/input/ubo2003_read.h"
#include "encoder/input/ubo2014_read.h"

namespace btfc {
namespace {

constexpr auto kFormats = std::to_array<DatasetFormat>({
    {"ubo2003", is_ubo2003, read_ubo2003},
    {"relight", is_relight, read_relight},
    {"lights", is_lights, read_lights},
    {"stack", is_stack, read_stack},
    {"ubo2014", is_ubo2014, read_ubo2014},
    {"btf_exr", is_btf_exr, read_btf_exr},
});

const DatasetFormat* format_of(const std::string& path) {
  for (const DatasetFormat& format : dataset_formats()) {
    if (format.recognises(path)) return &format;
  }
  return nullptr;
}

}  // namespace

std::span<const DatasetFormat> dataset_formats() { return kFormats; }

Result<Rectangle> kept_texels(const DatasetReadOptions& options, std::uint32_t width, std::uint32_t height,
                              const std::string& path) {
  const Rectangle r = options.crop.value_or(Rectangle{0, 0, width, height});
  if (r.width < 1 || r.height < 1 || std::uint64_t{r.x} + r.width > width ||
      std::uint64_t{r.y} + r.height > height) {
    return bad_argument(fmt::format("the crop {},{},{},{} does not lie inside '{}' of {}x{} texels", r.x, r.y,
                                    r.width, r.height, path, width, height));
  }
  return r;
}

bool is_dataset(const std::string& path) { return format_of(path) != nullptr; }

Result<DatasetRead> read_dataset(const std::string& path, const DatasetReadOptions& options) {
  const DatasetFormat* format = format_of(path);
  if (format != nullptr) return format->read(path, options);
  std::string known;
  for (const DatasetFormat& each : dataset_formats())
    known += std::string(known.empty() ? "" : ", ") + each.name;
  return bad_argument(fmt::format("'{}' is no data set of a known kind ({})", path, known));
}

}  // namespace btfc
