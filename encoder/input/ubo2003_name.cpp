// Angles in file names.
#include "encoder/input/ubo2003_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>

#include "encoder/input/directory_files.h"

namespace btfc {
namespace {

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// The number at `at`, behind blanks and underscores.
std::optional<double> number_at(std::string_view name, std::size_t at) {
  while (at < name.size() && (name[at] == ' ' || name[at] == '_')) ++at;
  std::size_t end = at;
  if (end < name.size() && (name[end] == '-' || name[end] == '+')) ++end;
  const std::size_t digits = end;
  while (end < name.size() && is_digit(name[end])) ++end;
  if (end == digits || end - digits > 9) return std::nullopt;
  if (end + 1 < name.size() && name[end] == '.' && is_digit(name[end + 1])) {
    ++end;
    while (end < name.size() && is_digit(name[end])) ++end;
  }
  if (name[at] == '+') ++at;  // from_chars takes a minus only
  double value = 0;
  std::from_chars(name.data() + at, name.data() + end, value);
  return value;
}

// The number behind a key that comes exactly once.
std::optional<double> number_of_key(std::string_view lower, std::string_view key) {
  std::optional<double> found;
  for (std::size_t at = lower.find(key); at != std::string_view::npos; at = lower.find(key, at + 1)) {
    if (at > 0 && is_letter(lower[at - 1])) continue;
    const std::optional<double> number = number_at(lower, at + key.size());
    if (!number) continue;
    if (found) return std::nullopt;
    found = number;
  }
  return found;
}

}  // namespace

std::optional<Ubo2003Angles> ubo2003_angles(std::string_view name) {
  const std::string lower = lower_case(name);
  const auto tl = number_of_key(lower, "tl"), pl = number_of_key(lower, "pl");
  const auto tv = number_of_key(lower, "tv"), pv = number_of_key(lower, "pv");
  if (!tl || !pl || !tv || !pv) return std::nullopt;
  return Ubo2003Angles{*tl, *pl, *tv, *pv};
}

bool is_utia_name(std::string_view name) {
  const std::string lower = lower_case(name);
  const std::size_t pl = lower.find("_pl"), tv = lower.find("_tv"), pv = lower.find("_pv");
  return lower.substr(0, 2) == "tl" && pl < tv && tv < pv && pv != std::string::npos &&
         std::count(lower.begin(), lower.end(), '_') == 3;
}

std::string ubo2003_angle_text(double angle) {
  std::string text = fmt::format("{:010.6f}", angle);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace btfc
