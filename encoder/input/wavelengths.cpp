// Numbers at the ends of names.
#include "encoder/input/wavelengths.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>

namespace btfc {
namespace {

struct Wavelength {
  std::string_view before;  // what stands before the number
  double nanometres = 0;
};

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string_view without_unit(std::string_view name) {
  const auto strip_blanks = [&] {
    while (!name.empty() && (name.back() == ' ' || name.back() == '_')) name.remove_suffix(1);
  };
  strip_blanks();
  if (name.size() > 2 && std::tolower(static_cast<unsigned char>(name[name.size() - 2])) == 'n' &&
      std::tolower(static_cast<unsigned char>(name.back())) == 'm') {
    name.remove_suffix(2);
    strip_blanks();
  }
  return name;
}

std::optional<Wavelength> wavelength_at(std::string_view name, std::size_t begin) {
  std::string number(name.substr(begin));
  std::replace(number.begin(), number.end(), ',', '.');
  double value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (error != std::errc() || end != number.data() + number.size()) return std::nullopt;
  if (!(value >= 100 && value <= 20000)) return std::nullopt;
  return Wavelength{name.substr(0, begin), value};
}

std::optional<Wavelength> wavelength_of(std::string_view whole) {
  const std::string_view name = without_unit(whole);
  const auto digits_before = [&](std::size_t end) {
    while (end > 0 && is_digit(name[end - 1])) --end;
    return end;
  };
  const std::size_t begin = digits_before(name.size());
  if (begin == name.size()) return std::nullopt;
  if (begin > 0 && (name[begin - 1] == '.' || name[begin - 1] == ',')) {
    const std::size_t whole_part = digits_before(begin - 1);
    if (whole_part < begin - 1) {
      if (const auto found = wavelength_at(name, whole_part)) return found;
    }
  }
  return wavelength_at(name, begin);
}

}  // namespace

std::vector<double> wavelengths_of(std::span<const std::string> names) {
  std::vector<double> out;
  std::string_view before;
  for (const std::string& name : names) {
    const std::optional<Wavelength> found = wavelength_of(name);
    if (!found || (!out.empty() && found->before != before)) return {};
    before = found->before;
    out.push_back(found->nanometres);
  }
  return out;
}

}  // namespace btfc
