// Lines, words and numbers.
#include "encoder/input/text_numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "encoder/output/atomic_file.h"

namespace btfc {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{16} << 20;

}  // namespace

Result<std::vector<std::string>> read_lines(const std::string& path) {
  std::error_code unknown;
  if (const auto size = std::filesystem::file_size(path, unknown); !unknown && size > kMaxTextBytes) {
    return Error{Status::limit,
                 fmt::format("'{}' is a text of {} bytes, expected at most {}", path, size, kMaxTextBytes),
                 "", 0};
  }
  const Result<Bytes> file = read_file(path);
  if (!file) return file.error();
  std::string_view text(reinterpret_cast<const char*>(file->data()), file->size());
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.size(), text.find('\n'));
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.emplace_back(line);
    text.remove_prefix(std::min(text.size(), end + 1));
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBetween = " \t,;\r\v\f";
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.size(), line.find_first_of(kBetween, at));
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBetween, end);
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::vector<std::vector<double>>> number_rows(const std::vector<std::string>& lines) {
  std::vector<std::vector<double>> rows;
  for (const std::string& line : lines) {
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty() || words[0][0] == '#' || words[0][0] == '%' || words[0][0] == '/') continue;
    std::vector<double> row;
    for (const std::string_view word : words) {
      const std::optional<double> number = number_of(word);
      if (!number) return std::nullopt;
      row.push_back(*number);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace btfc
