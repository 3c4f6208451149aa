// Writing images in bands of rows.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "encoder/input/directory_files.h"
#include "encoder/metrics/display_values.h"
#include "encoder/oiio/image_module.h"
#include "encoder/output/atomic_file.h"

namespace btfc {
namespace {

constexpr std::uint32_t kBandRows = 64;

// Half codes as 8 bits for looking at, by their display values; alpha is never coded.
std::vector<std::uint8_t> display_bytes(const std::vector<std::uint8_t>& codes, const ImageHeader& header,
                                        const std::vector<float>& display) {
  std::vector<std::uint8_t> bytes(codes.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool alpha = header.alpha != Alpha::none && i % header.channels == header.channels - 1;
    const std::uint16_t code = load_u16(&codes[2 * i]);
    const float v = alpha ? std::clamp(code_value(SampleType::float16, code), 0.0f, 1.0f) : display[code];
    bytes[i] = static_cast<std::uint8_t>(std::lrint(255.0f * v));
  }
  return bytes;
}

// OpenImageIO's writers do not all report a full disk, and its EXR writer reads freed memory when told of
// one. What they write goes through here: they always hear of success, and the pending file remembers that it
// failed.
class PendingProxy : public OIIO::Filesystem::IOProxy {
 public:
  explicit PendingProxy(PendingFile& file) : IOProxy(file.path(), Write), file_(file) {}
  const char* proxytype() const override { return "btfc"; }
  std::size_t size() const override { return static_cast<std::size_t>(size_); }
  std::size_t write(const void* data, std::size_t count) override {
    const std::size_t wrote = pwrite(data, count, m_pos);
    m_pos += static_cast<std::int64_t>(wrote);
    return wrote;
  }
  std::size_t pwrite(const void* data, std::size_t count, std::int64_t offset) override {
    const ByteView bytes(static_cast<const std::uint8_t*>(data), count);
    file_.write_at(static_cast<std::uint64_t>(offset), bytes);
    size_ = std::max(size_, offset + static_cast<std::int64_t>(count));
    return count;
  }

 private:
  PendingFile& file_;
  std::int64_t size_ = 0;
};

}  // namespace

Result<Done> oiio_write_rows(const std::string& path, const ImageHeader& header, const RowSource& rows) {
  const std::string kind = file_extension(path);
  const bool png = kind == "png", exr = kind == "exr";
  if (!png && !exr)
    return bad_argument(fmt::format("'{}' names no output format, expected .png or .exr", path));
  Result<PendingFile> pending = PendingFile::create(path);
  if (!pending) return pending.error();

  const bool display = png && header.type == SampleType::float16;
  const std::vector<float> shown_values =
      display ? display_table(header.type, header.colour_space) : std::vector<float>();
  const OIIO::TypeDesc::BASETYPE native = header.type == SampleType::unorm8    ? OIIO::TypeDesc::UINT8
                                          : header.type == SampleType::unorm16 ? OIIO::TypeDesc::UINT16
                                                                               : OIIO::TypeDesc::HALF;
  const OIIO::TypeDesc given = display ? OIIO::TypeDesc(OIIO::TypeDesc::UINT8) : OIIO::TypeDesc(native);
  const OIIO::TypeDesc stored = png                                  ? given
                                : header.type == SampleType::unorm16 ? OIIO::TypeDesc(OIIO::TypeDesc::FLOAT)
                                                                     : OIIO::TypeDesc(OIIO::TypeDesc::HALF);
  OIIO::ImageSpec spec(static_cast<int>(header.width), static_cast<int>(header.height),
                       static_cast<int>(header.channels), stored);
  if (exr && header.channel_names.size() == header.channels) spec.channelnames = header.channel_names;
  spec.alpha_channel = header.alpha == Alpha::none ? -1 : spec.nchannels - 1;
  spec["oiio:UnassociatedAlpha"] = header.alpha == Alpha::straight ? 1 : 0;
  if (png) spec["png:compressionLevel"] = 3;
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(pending->path());
  PendingProxy proxy(*pending);
  if (output) output->set_ioproxy(&proxy);
  if (!output || !output->open(pending->path(), spec)) {
    return io_error(
        fmt::format("could not write '{}': {}", path, output ? output->geterror() : OIIO::geterror()));
  }
  const std::size_t sample_bytes = header.type == SampleType::unorm8 ? 1 : 2;
  const std::size_t row_bytes = std::size_t{header.width} * header.channels * sample_bytes;
  std::vector<std::uint8_t> band;
  for (std::uint32_t y = 0; y < header.height; y += kBandRows) {
    const std::uint32_t count = std::min(kBandRows, header.height - y);
    band.resize(count * row_bytes);
    if (const auto filled = rows(y, count, band.data()); !filled) return filled.error();
    const std::vector<std::uint8_t> shown =
        display ? display_bytes(band, header, shown_values) : std::vector<std::uint8_t>();
    const void* data = display ? shown.data() : band.data();
    if (!output->write_scanlines(static_cast<int>(y), static_cast<int>(y + count), 0, given, data)) {
      return io_error(fmt::format("could not write '{}': {}", path, output->geterror()));
    }
  }
  if (!output->close()) return io_error(fmt::format("could not write '{}': {}", path, output->geterror()));
  return pending->commit();
}

}  // namespace btfc
