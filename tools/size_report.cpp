// Integers first, then the rates that follow from them.
#include "tools/size_report.h"

#include <fmt/format.h>

namespace btfc {

Json value_of(const Parameter& parameter) {
  return parameter.number ? Json::parse(parameter.value) : Json(parameter.value);
}

Json size_json(const Head& head, const Layout& layout) {
  const std::uint64_t texels = std::uint64_t{head.width} * head.height;
  const std::uint64_t samples = texels * head.pairs * head.channels();
  std::uint64_t payload_bytes = 0;
  for (const ChunkSpec& chunk : layout.chunks)
    payload_bytes += (chunk.key.flags & kPayload) != 0 ? chunk.raw_bytes : 0;
  const auto payload_bits = static_cast<double>(8 * payload_bytes);

  Json maps = Json::array();
  for (std::size_t m = 0; m < head.maps.size(); ++m) {
    const Map& map = head.maps[m];
    maps.push_back({{"name", map.name},
                    {"channels", map.channels},
                    {"sample_type", name_of(map.type)},
                    {"colour_space", name_of(map.colour_space)},
                    {"formula_bits", layout.map_bits[m]}});
  }
  Json parameters = Json::object();
  for (const Parameter& p : layout.parameters) parameters[p.name] = value_of(p);
  Json json = {{"model", find_model(head.model)->name},
               {"format_version", fmt::format("{}.{}", kVersionMajor, kVersionMinor)},
               {"width", head.width},
               {"height", head.height},
               {"channels", head.channels()},
               {"maps", maps},
               {"views", head.views},
               {"lights", head.lights},
               {"pairs", head.pairs},
               {"unbounded", head.unbounded},
               {"payload_bits", 8 * payload_bytes},
               {"formula_bits", layout.formula_bits},
               {"memory_bits", layout.memory_bits},
               {"raw_bytes_u8", samples},
               {"bits_per_texel", payload_bits / static_cast<double>(texels)},
               {"bits_per_sample", payload_bits / static_cast<double>(samples)},
               {"ratio_u8", 8.0 * static_cast<double>(samples) / payload_bits},
               {"ratio_u16", 16.0 * static_cast<double>(samples) / payload_bits}};
  if (layout.paper) {
    json["paper"] = {
        {"name", layout.paper->name},
        {"bits", layout.paper->bits},
        {"bits_per_texel", static_cast<double>(layout.paper->bits) / static_cast<double>(texels)}};
    for (const Parameter& p : layout.paper->counts) json["paper"][p.name] = value_of(p);
  }
  const auto add_cost = [&](const char* key, const std::optional<TexelCost>& cost) {
    if (cost)
      json[key] = {{"operations", cost->operations}, {"reads", cost->reads}, {"bytes", cost->bytes()}};
  };
  add_cost("cost", layout.cost);
  add_cost("cost_prepared", layout.prepared_cost);
  json["parameters"] = parameters;
  return json;
}

std::string text_of(const Json& json) {
  std::string text;
  for (const auto& [key, value] : json.items()) {
    std::string shown;
    if (value.is_object()) {
      for (const auto& [k, v] : value.items()) {
        shown += fmt::format("{}{} {}", shown.empty() ? "" : ", ", k,
                             v.is_string() ? v.get<std::string>() : v.dump());
      }
    } else if (value.is_array()) {
      for (const auto& v : value) shown += fmt::format("\n  {}", v.dump());
    } else if (value.is_number_float()) {
      shown = fmt::format("{:.6g}", value.get<double>());
    } else {
      shown = value.is_string() ? value.get<std::string>() : value.dump();
    }
    text += fmt::format("{}{:<20} {}", text.empty() ? "" : "\n", key, shown);
  }
  return text;
}

}  // namespace btfc
