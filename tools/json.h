// JSON as the command prints it: members in the order in which they are added.
#pragma once
#include <nlohmann/json.hpp>

namespace btfc {

using Json = nlohmann::ordered_json;

}  // namespace btfc
