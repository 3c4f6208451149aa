// Reading, checking and writing META.
#include "format/meta.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "format/limits.h"

namespace btfc {
namespace {

bool valid_key(std::string_view key) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ':';
  };
  return !key.empty() && key.size() <= 64 && std::all_of(key.begin(), key.end(), good);
}

// Shortest forms only, no surrogates, nothing above U+10FFFF.
bool valid_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80       ? 1
                               : lead >> 5 == 6  ? 2
                               : lead >> 4 == 14 ? 3
                               : lead >> 3 == 30 ? 4
                                                 : 0;
    if (length == 0 || i + length > text.size()) return false;
    std::uint32_t code = length == 1 ? lead : lead & (0xffu >> (length + 1));
    for (std::size_t k = 1; k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      if (next >> 6 != 2) return false;
      code = code << 6 | (next & 0x3fu);
    }
    constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    if (code < kLeast[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return false;
    i += length;
  }
  return true;
}

}  // namespace

Bytes write_meta(const Meta& meta) {
  std::string text;
  for (const auto& [key, value] : meta) {
    std::string line = value;
    std::replace_if(
        line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
    text += key + '=' + line + '\n';
  }
  return Bytes(text.begin(), text.end());
}

Result<Meta> read_meta(ByteView raw) {
  if (raw.size() > kMaxMetaBytes)
    return invalid("M1", 0, fmt::format("META has {} bytes, expected at most 2^20", raw.size()));
  const std::string_view text(reinterpret_cast<const char*>(raw.data()), raw.size());
  if (text.empty() || text.back() != '\n') return invalid("M1", 0, "META does not end with a line feed");
  if (!valid_utf8(text)) return invalid("M1", 0, "META is not UTF-8");
  Meta meta;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const std::string_view line = text.substr(begin, end - begin);
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || !valid_key(line.substr(0, equals))) {
      return invalid("M1", begin, fmt::format("META has a line without a valid key, at byte {}", begin));
    }
    const std::string_view value = line.substr(equals + 1);
    if (std::any_of(value.begin(), value.end(),
                    [](char c) { return static_cast<unsigned char>(c) < 0x20; })) {
      return invalid("M1", begin, fmt::format("META has a control character in a value, at byte {}", begin));
    }
    std::string key(line.substr(0, equals));
    if (!meta.empty() && meta.rbegin()->first >= key) {
      return invalid("M1", begin, fmt::format("META: key '{}' is out of order or repeated", key));
    }
    meta.emplace(std::move(key), value);
    begin = end + 1;
  }
  return meta;
}

}  // namespace btfc
