// Parsing of model options; std::from_chars, so that no locale changes what a number means.
#include "format/options.h"

#include <fmt/format.h>

#include <charconv>

namespace btfc {
namespace {

std::optional<std::uint32_t> whole_number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::optional<std::string> find_option(const OptionValues& values, const std::string& name) {
  const auto found = values.find(name);
  if (found == values.end()) return std::nullopt;
  return found->second;
}

std::optional<std::vector<std::uint32_t>> split_numbers(const std::string& text, char separator) {
  std::vector<std::uint32_t> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    const auto number = whole_number(std::string_view(text).substr(begin, end - begin));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers;
}

Result<std::optional<std::uint32_t>> parse_u32(const OptionValues& values, const char* name,
                                               std::uint32_t least, std::uint32_t most) {
  const auto text = find_option(values, name);
  if (!text) return std::optional<std::uint32_t>();
  const auto value = whole_number(*text);
  if (!value || *value < least || *value > most) {
    return bad_argument(
        fmt::format("--{} is '{}', expected a whole number from {} to {}", name, *text, least, most));
  }
  return value;
}

Result<std::optional<double>> parse_double(const OptionValues& values, const char* name, double least,
                                           double most) {
  const auto text = find_option(values, name);
  if (!text) return std::optional<double>();
  double value = 0;
  const auto [end, fault] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (fault != std::errc{} || end != text->data() + text->size() || !(value >= least && value <= most)) {
    return bad_argument(
        fmt::format("--{} is '{}', expected a number from {} to {}", name, *text, least, most));
  }
  return std::optional<double>(value);
}

Result<std::optional<std::pair<std::uint32_t, std::uint32_t>>> parse_pair(
    const OptionValues& values, const char* name, std::uint32_t least, std::uint32_t most, bool one_number) {
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  const auto text = find_option(values, name);
  if (!text) return std::optional<Pair>();
  auto numbers = split_numbers(*text, 'x');
  if (numbers && one_number && numbers->size() == 1) numbers->push_back(numbers->front());
  const auto fits = [&](std::uint32_t n) { return n >= least && n <= most; };
  if (!numbers || numbers->size() != 2 || !fits((*numbers)[0]) || !fits((*numbers)[1])) {
    return bad_argument(fmt::format("--{} is '{}', expected {} with numbers from {} to {}", name, *text,
                                    one_number ? "N or NxM" : "WxH", least, most));
  }
  return std::optional<Pair>(Pair((*numbers)[0], (*numbers)[1]));
}

Result<std::optional<std::size_t>> parse_choice(const OptionValues& values, const char* name,
                                                std::span<const char* const> choices) {
  const auto text = find_option(values, name);
  if (!text) return std::optional<std::size_t>();
  std::string list;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (*text == choices[i]) return std::optional<std::size_t>(i);
    list += fmt::format("{}{}", i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ", choices[i]);
  }
  return bad_argument(fmt::format("--{} is '{}', expected {}", name, *text, list));
}

}  // namespace btfc
