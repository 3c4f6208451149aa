// Radiance pictures, after the author's description (Ward, "Real Pixels", Graphics Gems II, and filefmts.pdf
// of the Radiance distribution).
#include "encoder/input/radiance_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "encoder/input/directory_files.h"
#include "encoder/output/atomic_file.h"
#include "format/limits.h"

namespace btfc {
namespace {

// Run lengths can stand for any number of texels; what they may ask for is bounded.
constexpr std::uint64_t kMaxTexels = std::uint64_t{1} << 28;

// Axes of the stored raster: `lines` scanlines of `length` texels. Ward's "-Y h +X w" is rows from the top,
// columns from the left: y points up in the file's own terms.
struct Raster {
  std::uint32_t lines = 0, length = 0;
  bool lines_are_columns = false;
  bool from_right = false, from_bottom = false;
  double exposure = 1;
};

Error damaged(const std::string& path, const std::string& what) {
  return bad_data(fmt::format("the Radiance picture '{}' {}", path, what));
}

// "-Y 256": the sign, the axis and the count.
struct Axis {
  char sign = 0, name = 0;
  std::uint32_t count = 0;
};

bool take_axis(std::string_view& text, Axis& axis) {
  if (text.size() < 4 || (text[0] != '+' && text[0] != '-') || (text[1] != 'X' && text[1] != 'Y') ||
      text[2] != ' ') {
    return false;
  }
  axis.sign = text[0];
  axis.name = text[1];
  const auto [end, error] = std::from_chars(text.data() + 3, text.data() + text.size(), axis.count);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return error == std::errc() && axis.count >= 1 && axis.count <= kMaxSide;
}

Result<Raster> raster_of(const std::string& path, std::string_view line, double exposure) {
  Axis slow, fast;
  std::string_view rest = line;
  bool good = take_axis(rest, slow) && !rest.empty() && rest[0] == ' ';
  if (good) {
    rest.remove_prefix(1);
    good = take_axis(rest, fast) && rest.empty() && slow.name != fast.name;
  }
  if (!good) {
    return damaged(path, fmt::format("has the resolution line '{}', expected one as '-Y 256 +X 256' of at "
                                     "most {} texels a side",
                                     line.substr(0, 60), kMaxSide));
  }
  if (std::uint64_t{slow.count} * fast.count > kMaxTexels) {
    return Error{Status::limit,
                 fmt::format("the Radiance picture '{}' has {}x{} texels, expected at most {} in all", path,
                             slow.count, fast.count, kMaxTexels),
                 "", 0};
  }
  const Axis &x = slow.name == 'X' ? slow : fast, &y = slow.name == 'X' ? fast : slow;
  return Raster{slow.count, fast.count, slow.name == 'X', x.sign == '-', y.sign == '+', exposure};
}

// The header's lines, to the resolution line included; `at` is where the texels begin.
Result<Raster> read_header(const std::string& path, ByteView file, std::size_t& at) {
  double exposure = 1;
  bool in_variables = true;
  for (std::size_t lines = 0;; ++lines) {
    const auto* const begin = file.data() + at;
    const auto* const end = std::find(begin, file.data() + file.size(), std::uint8_t{'\n'});
    if (end == file.data() + file.size()) return damaged(path, "ends within its header");
    std::string_view line(reinterpret_cast<const char*>(begin), static_cast<std::size_t>(end - begin));
    at += line.size() + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (lines == 0 && line.substr(0, 2) != "#?") return damaged(path, "does not begin with '#?'");
    if (!in_variables) return raster_of(path, line, exposure);
    in_variables = !line.empty();
    if (line.substr(0, 7) == "FORMAT=" && line != "FORMAT=32-bit_rle_rgbe") {
      return Error{Status::unsupported,
                   fmt::format("the Radiance picture '{}' has '{}', expected FORMAT=32-bit_rle_rgbe", path,
                               line.substr(0, 60)),
                   "", 0};
    }
    if (line.substr(0, 9) == "EXPOSURE=") {
      std::string_view number = line.substr(9);
      while (!number.empty() && number[0] == ' ') number.remove_prefix(1);
      double factor = 0;
      std::from_chars(number.data(), number.data() + number.size(), factor);
      exposure *= factor;  // several lines multiply
      if (!(factor > 0 && exposure > 0 && std::isfinite(exposure))) {
        return damaged(path, fmt::format("has '{}', expected a number above 0", line.substr(0, 60)));
      }
    }
  }
}

// Decodes scanlines; every read and write is checked against what is left.
class Scanlines {
 public:
  Scanlines(ByteView file, std::size_t at, std::uint32_t length) : file_(file), at_(at), length_(length) {}

  // Appends one scanline of RGBE texels; what is wrong with it, or nothing.
  const char* read(std::vector<std::uint8_t>& texels) {
    const std::size_t first = texels.size();
    texels.resize(first + std::size_t{length_} * 4);
    std::uint8_t* line = texels.data() + first;
    if (left() < 4) return "ends before its last texel";
    const std::uint8_t* p = file_.data() + at_;
    const bool separate = length_ >= 8 && length_ <= 32767 && p[0] == 2 && p[1] == 2 && p[2] < 128;
    return separate ? separate_runs(line) : texel_runs(line);
  }

 private:
  std::size_t left() const { return file_.size() - at_; }

  // The four components one after another, each in runs and literals.
  const char* separate_runs(std::uint8_t* line) {
    const std::uint8_t* p = file_.data() + at_;
    if ((std::uint32_t{p[2]} << 8 | p[3]) != length_) return "has a scanline of another length";
    at_ += 4;
    for (std::size_t component = 0; component < 4; ++component) {
      for (std::uint32_t x = 0; x < length_;) {
        if (left() < 2) return "ends before its last texel";
        const std::uint32_t code = file_[at_++];
        const bool run = code > 128;
        const std::uint32_t count = run ? code - 128 : code;
        if (count == 0 || count > length_ - x) return "has a run beyond its scanline";
        if (left() < (run ? 1 : count)) return "ends before its last texel";
        for (std::uint32_t i = 0; i < count; ++i) {
          line[std::size_t{x++} * 4 + component] = file_[at_ + (run ? 0 : i)];
        }
        at_ += run ? 1 : count;
      }
    }
    return nullptr;
  }

  // Texels as they are; (1, 1, 1, n) repeats the texel before n times, further such texels count 256 fold.
  const char* texel_runs(std::uint8_t* line) {
    unsigned shift = 0;
    for (std::uint32_t x = 0; x < length_;) {
      if (left() < 4) return "ends before its last texel";
      const std::uint8_t* p = file_.data() + at_;
      at_ += 4;
      if (p[0] == 1 && p[1] == 1 && p[2] == 1) {
        const std::uint64_t count = shift > 16 ? kMaxSide + 1 : std::uint64_t{p[3]} << shift;
        if (x == 0 || count > length_ - x) return "has a run beyond its scanline";
        for (std::uint64_t i = 0; i < count; ++i, ++x) {
          std::copy_n(line + std::size_t{x - 1} * 4, 4, line + std::size_t{x} * 4);
        }
        shift += 8;
      } else {
        std::copy_n(p, 4, line + std::size_t{x++} * 4);
        shift = 0;
      }
    }
    return nullptr;
  }

  ByteView file_;
  std::size_t at_;
  std::uint32_t length_;
};

}  // namespace

bool is_radiance(const std::string& path) {
  const std::string extension = file_extension(path);
  return extension == "hdr" || extension == "rgbe";
}

Result<RadianceImage> read_radiance(const std::string& path) {
  const Result<Bytes> file = read_file(path);
  if (!file) return file.error();
  std::size_t at = 0;
  const Result<Raster> raster = read_header(path, *file, at);
  if (!raster) return raster.error();
  Scanlines scanlines(*file, at, raster->length);
  std::vector<std::uint8_t> texels;  // grows with what is there: the header alone asks for no memory
  for (std::uint32_t line = 0; line < raster->lines; ++line) {
    if (const char* wrong = scanlines.read(texels)) return damaged(path, wrong);
  }

  RadianceImage image;
  image.width = raster->lines_are_columns ? raster->lines : raster->length;
  image.height = raster->lines_are_columns ? raster->length : raster->lines;
  image.rgb.resize(texels.size() / 4 * 3);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const std::uint32_t column = raster->from_right ? image.width - 1 - x : x;
      const std::uint32_t row = raster->from_bottom ? image.height - 1 - y : y;
      const std::uint32_t line = raster->lines_are_columns ? column : row;
      const std::uint32_t place = raster->lines_are_columns ? row : column;
      const std::uint8_t* texel = &texels[(std::size_t{line} * raster->length + place) * 4];
      // mantissa 2^(e - 136); e = 0 is black
      const double scale = texel[3] == 0 ? 0 : std::ldexp(1.0, texel[3] - 136) / raster->exposure;
      float* rgb = &image.rgb[(std::size_t{y} * image.width + x) * 3];
      for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<float>(texel[c] * scale);
    }
  }
  return image;
}

}  // namespace btfc
