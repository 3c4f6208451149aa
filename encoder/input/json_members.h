// What readers of JSON ask of objects.
#pragma once
#include <algorithm>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace btfc {

// The first member of an object that is not among the known ones.
inline std::optional<std::string> unknown_member(const nlohmann::json& object,
                                                 std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) return key;
  }
  return std::nullopt;
}

}  // namespace btfc
