// .ptm <-> struct: lines of ASCII, then bytes, the bottom row first.
#include "encoder/input/ptm_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "format/limits.h"

namespace btfc {
namespace {

constexpr std::size_t kTerms = 6;
constexpr double kLargestScale = 1e6;
constexpr std::int32_t kLargestBias = 1'000'000;

// The words of the head, whatever lines they stand on; the last is ended by exactly one line end.
class Words {
 public:
  explicit Words(ByteView bytes) : bytes_(bytes) {}
  // Empty where the file ends.
  std::string_view next() {
    while (at_ < bytes_.size() && blank(bytes_[at_])) ++at_;
    const std::size_t first = at_;
    while (at_ < bytes_.size() && !blank(bytes_[at_])) ++at_;
    return {reinterpret_cast<const char*>(bytes_.data()) + first, at_ - first};
  }
  // The first byte behind the line.
  std::size_t end_line() {
    while (at_ < bytes_.size() && (bytes_[at_] == ' ' || bytes_[at_] == '\t')) ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '\r') ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '\n') ++at_;
    return at_;
  }

 private:
  static bool blank(std::uint8_t c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  ByteView bytes_;
  std::size_t at_ = 0;
};

template <class Number>
std::optional<Number> number(std::string_view word) {
  Number value{};
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::optional<std::uint32_t> side(std::string_view word) {
  const auto n = number<std::uint32_t>(word);
  return n && *n >= 1 && *n <= kMaxSide ? n : std::nullopt;
}

// Rows of `row` bytes in reverse order.
void copy_flipped(const std::uint8_t* from, std::size_t row, std::size_t rows, std::uint8_t* to) {
  for (std::size_t y = 0; y < rows; ++y) std::copy_n(from + y * row, row, to + (rows - 1 - y) * row);
}

}  // namespace

bool is_ptm_file(ByteView bytes) {
  constexpr std::string_view kBegin = "PTM_1.";
  return bytes.size() > kBegin.size() && std::equal(kBegin.begin(), kBegin.end(), bytes.begin());
}

Result<PtmFile> parse_ptm_file(const std::string& path, ByteView bytes) {
  Words words(bytes);
  const std::string_view version = words.next(), form = words.next();
  if (version != "PTM_1.1" && version != "PTM_1.2") {
    return bad_data(fmt::format("'{}' does not begin with PTM_1.1 or PTM_1.2", path));
  }
  PtmFile file;
  if (form == "PTM_FORMAT_LRGB") {
    file.form = PtmForm::lrgb;
  } else if (form != "PTM_FORMAT_RGB") {
    return unsupported(
        "", 0,
        fmt::format("'{}' is of '{}', expected PTM_FORMAT_RGB or PTM_FORMAT_LRGB", path, form.substr(0, 40)));
  }
  const auto width = side(words.next()), height = side(words.next());
  if (!width || !height)
    return bad_data(fmt::format("'{}' has no width and height of 1 to {} texels", path, kMaxSide));
  file.width = *width;
  file.height = *height;
  for (double& scale : file.scale) {
    const auto n = number<double>(words.next());
    if (!n || !(std::fabs(*n) <= kLargestScale))
      return bad_data(fmt::format("'{}' has not six scales within {}", path, kLargestScale));
    scale = *n;
  }
  for (std::int32_t& bias : file.bias) {
    const auto n = number<std::int32_t>(words.next());
    if (!n || std::abs(std::int64_t{*n}) > kLargestBias)
      return bad_data(fmt::format("'{}' has not six whole biases within {}", path, kLargestBias));
    bias = *n;
  }
  const std::size_t first = words.end_line(), texels = file.texels();
  const std::size_t texel = file.form == PtmForm::rgb ? 3 * kTerms : kTerms + 3;
  if (bytes.size() - first < texels * texel) {
    return bad_data(fmt::format("'{}' has {} bytes behind its head, expected {}", path, bytes.size() - first,
                                texels * texel));
  }
  const std::uint8_t* from = bytes.data() + first;
  const std::size_t row = std::size_t{file.width} * kTerms;
  if (file.form == PtmForm::rgb) {
    file.coefficients.resize(texels * 3 * kTerms);
    for (std::size_t c = 0; c < 3; ++c)
      copy_flipped(from + c * texels * kTerms, row, file.height, &file.coefficients[c * texels * kTerms]);
    return file;
  }
  file.coefficients.resize(texels * kTerms);
  file.colours.resize(texels * 3);
  if (version == "PTM_1.2") {
    copy_flipped(from, row, file.height, file.coefficients.data());
    copy_flipped(from + texels * kTerms, std::size_t{file.width} * 3, file.height, file.colours.data());
    return file;
  }
  // 1.1: nine bytes a texel.
  for (std::size_t y = 0; y < file.height; ++y) {
    for (std::size_t x = 0; x < file.width; ++x, from += kTerms + 3) {
      const std::size_t t = (file.height - 1 - y) * file.width + x;
      std::copy_n(from, kTerms, &file.coefficients[t * kTerms]);
      std::copy_n(from + kTerms, 3, &file.colours[t * 3]);
    }
  }
  return file;
}

Bytes write_ptm_file(const PtmFile& file) {
  std::string head =
      fmt::format("PTM_1.2\n{}\n{}\n{}\n", file.form == PtmForm::rgb ? "PTM_FORMAT_RGB" : "PTM_FORMAT_LRGB",
                  file.width, file.height);
  for (std::size_t k = 0; k < kTerms; ++k) head += fmt::format("{}{}", k == 0 ? "" : " ", file.scale[k]);
  head += '\n';
  for (std::size_t k = 0; k < kTerms; ++k) head += fmt::format("{}{}", k == 0 ? "" : " ", file.bias[k]);
  head += '\n';
  const std::size_t first = head.size(), row = std::size_t{file.width} * kTerms;
  Bytes bytes(first + file.coefficients.size() + file.colours.size());
  std::copy(head.begin(), head.end(), bytes.begin());
  const std::size_t plane = file.texels() * kTerms;
  for (std::size_t at = 0; at < file.coefficients.size(); at += plane)
    copy_flipped(&file.coefficients[at], row, file.height, &bytes[first + at]);
  if (!file.colours.empty())
    copy_flipped(file.colours.data(), std::size_t{file.width} * 3, file.height,
                 &bytes[first + file.coefficients.size()]);
  return bytes;
}

}  // namespace btfc
