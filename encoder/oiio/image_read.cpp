// Reading images.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "encoder/colour_primaries.h"
#include "encoder/input/radiance_read.h"
#include "encoder/oiio/image_module.h"
#include "encoder/output/atomic_file.h"
#include "format/limits.h"

namespace btfc {
namespace {

// What the file itself states; nothing is guessed from a missing attribute.
ColourSpace colour_space_of_file(const OIIO::ImageSpec& spec, SampleType type) {
  if (type != SampleType::float16) {
    const std::string stated = spec.get_string_attribute("oiio:ColorSpace");
    return stated == "sRGB" && spec.nchannels >= 3 ? ColourSpace::srgb_rec709_scene : ColourSpace::unknown;
  }
  const OIIO::ParamValue* found =
      spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
  if (found == nullptr) return ColourSpace::unknown;
  const auto* xy = static_cast<const float*>(found->data());
  for (const Primaries& known : kPrimaries) {
    bool same = true;
    for (std::size_t i = 0; i < 8; ++i) same = same && std::fabs(xy[i] - known.xy[i]) < 0.001f;
    if (same) return known.space;
  }
  return ColourSpace::unknown;
}

// OpenImageIO may say several lines; the first tells what is wrong.
Error unreadable(const std::string& path, const std::string& why) {
  return io_error(fmt::format("could not read the image '{}': {}", path, why.substr(0, why.find('\n'))));
}

// Float samples -> binary16 codes; the first value that has none is named.
Result<Done> to_half_codes(const std::string& path, const std::vector<float>& values, Image& image) {
  std::size_t bad = 0, first = 0;
  image.codes.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::optional<std::uint16_t> code = finite_half(values[i]);
    if (!code && bad++ == 0) first = i;
    image.codes[i] = code.value_or(0);
  }
  if (bad == 0) return Done{};
  const std::size_t texel = first / image.channels;
  return bad_data(fmt::format(
      "'{}' has {} samples that are not finite or beyond 65504, the first is {} at ({}, {}) "
      "channel {}; expected finite half floats",
      path, bad, values[first], texel % image.width, texel / image.width, first % image.channels));
}

// Whether a JPEG's scans run to its end marker. libjpeg fills what is missing with grey and only warns, which
// OpenImageIO does not pass on. Markers: ISO 10918-1, table B.1.
bool jpeg_is_whole(ByteView file) {
  std::size_t at = 2;  // behind the start marker
  while (at + 4 <= file.size()) {
    if (file[at] != 0xff) return false;
    const std::uint8_t marker = file[at + 1];
    if (marker == 0xff) {  // a fill byte
      ++at;
      continue;
    }
    if (marker == 0xd9) return true;
    at += 2 + (std::size_t{file[at + 2]} << 8 | file[at + 3]);
    if (marker != 0xda) continue;
    // Coded data until a marker that is neither a stuffed 0xff nor a restart.
    const auto is_data = [](std::uint8_t m) { return m == 0 || (m >= 0xd0 && m <= 0xd7); };
    while (at + 1 < file.size() && (file[at] != 0xff || is_data(file[at + 1]))) ++at;
  }
  return at + 1 < file.size() && file[at] == 0xff && file[at + 1] == 0xd9;
}

Result<ImageFile> read_radiance_image(const std::string& path, std::uint32_t max_channels) {
  const Result<RadianceImage> radiance = read_radiance(path);
  if (!radiance) return radiance.error();
  if (max_channels < 3) {
    return unsupported("", 0, fmt::format("'{}' has 3 channels, expected {}", path, max_channels));
  }
  ImageFile out{{}, {"R", "G", "B"}};
  out.image.width = radiance->width;
  out.image.height = radiance->height;
  out.image.channels = 3;
  out.image.type = SampleType::float16;
  if (const auto converted = to_half_codes(path, radiance->rgb, out.image); !converted)
    return converted.error();
  return out;
}

}  // namespace

Result<ImageFile> oiio_read(const std::string& path, std::uint32_t max_channels) {
  // By our own reader: OpenImageIO keeps the raster as stored, and 2.4 swaps two of the eight orders.
  if (is_radiance(path)) return read_radiance_image(path, max_channels);
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // codes as stored: PNG's alpha is not multiplied in
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &config);
  if (!input) return unreadable(path, OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  if (std::string_view(input->format_name()) == "jpeg") {
    const Result<Bytes> file = read_file(path);
    if (!file) return file.error();
    if (!jpeg_is_whole(*file)) return unreadable(path, "the JPEG file ends early");
  }
  if (spec.nchannels < 1 || spec.nchannels > static_cast<int>(max_channels) || spec.depth > 1) {
    return Error{Status::unsupported,
                 fmt::format("'{}' has {} channels and depth {}, expected 1 to {} channels of a flat image",
                             path, spec.nchannels, spec.depth, max_channels),
                 "", 0};
  }
  if (spec.width < 1 || spec.height < 1 || spec.width > static_cast<int>(kMaxSide) ||
      spec.height > static_cast<int>(kMaxSide)) {
    return Error{Status::unsupported,
                 fmt::format("'{}' is {}x{}, expected at most 65536 a side", path, spec.width, spec.height),
                 "", 0};
  }
  Image image;
  image.width = static_cast<std::uint32_t>(spec.width);
  image.height = static_cast<std::uint32_t>(spec.height);
  image.channels = static_cast<std::uint32_t>(spec.nchannels);
  const std::size_t samples = std::size_t{image.width} * image.height * image.channels;
  if (spec.alpha_channel >= 0 && spec.alpha_channel == spec.nchannels - 1 && spec.nchannels > 1) {
    const bool straight = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
    image.alpha = straight ? Alpha::straight : Alpha::premultiplied;
  }

  const auto read_as = [&](OIIO::TypeDesc type, void* data) {
    return input->read_image(0, 0, 0, spec.nchannels, type, data);
  };
  bool read = false;
  std::vector<float> values;
  switch (spec.format.basetype) {
    case OIIO::TypeDesc::UINT8: {
      std::vector<std::uint8_t> bytes(samples);
      read = read_as(OIIO::TypeDesc::UINT8, bytes.data());
      image.codes.assign(bytes.begin(), bytes.end());
      break;
    }
    case OIIO::TypeDesc::UINT16:
      image.type = SampleType::unorm16;
      image.codes.resize(samples);
      read = read_as(OIIO::TypeDesc::UINT16, image.codes.data());
      break;
    case OIIO::TypeDesc::HALF:
    case OIIO::TypeDesc::FLOAT:
      image.type = SampleType::float16;
      values.resize(samples);
      read = read_as(OIIO::TypeDesc::FLOAT, values.data());
      break;
    default:
      return Error{Status::unsupported,
                   fmt::format("'{}' has samples of type {}, expected 8 or 16 bit integers, half or float",
                               path, spec.format.c_str()),
                   "", 0};
  }
  if (!read) return unreadable(path, input->geterror());
  if (image.type == SampleType::float16) {
    if (const auto converted = to_half_codes(path, values, image); !converted) return converted.error();
  }
  image.colour_space = colour_space_of_file(spec, image.type);
  return ImageFile{std::move(image), spec.channelnames};
}

}  // namespace btfc
