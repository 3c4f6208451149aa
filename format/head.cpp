// Reading, checking and writing HEAD.
#include "format/head.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "format/limits.h"
#include "format/model_table.h"

namespace btfc {
namespace {

constexpr std::size_t kFixedBytes = 32, kMapBytes = 32, kNameBytes = 24;

constexpr std::array kSampleTypeNames = {"unorm8", "unorm16", "float16"};
constexpr std::array kColourSpaceNames = {"unknown",       "srgb_rec709_scene", "lin_rec709_scene",
                                          "lin_ap0_scene", "lin_ap1_scene",     "lin_ciexyzd65_scene",
                                          "data"};
constexpr std::array kQuantityNames = {"unspecified", "reflectance", "reflectance_cos", "radiance", "data"};

// The number of a name in its list.
template <class Enum, std::size_t kCount>
std::optional<Enum> find_name(const std::array<const char*, kCount>& names, std::string_view name) {
  const auto* const found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? std::nullopt : std::optional(static_cast<Enum>(found - names.begin()));
}

// A field whose values are 0 … last; the first fault of a HEAD is kept.
struct EnumReader {
  ByteView raw;
  std::string fault;
  std::uint8_t operator()(std::size_t at, unsigned last, const char* field) {
    if (raw[at] > last && fault.empty()) {
      fault = fmt::format("HEAD: {} is {}, expected 0 to {}", field, raw[at], last);
    }
    return raw[at] > last ? std::uint8_t{0} : raw[at];
  }
};

Result<Map> read_map(ByteView entry, std::size_t number) {
  Map map;
  const auto* text = reinterpret_cast<const char*>(entry.data());
  const std::size_t length = static_cast<std::size_t>(std::find(text, text + kNameBytes, '\0') - text);
  map.name.assign(text, length);
  const bool zeros = std::all_of(text + length, text + kNameBytes, [](char c) { return c == 0; });
  if (!valid_map_name(map.name) || !zeros) {
    return invalid(
        "H6", 0, fmt::format("HEAD: map {} has no valid name, expected 1 to 24 of A-Z a-z 0-9 _ -", number));
  }
  EnumReader field{entry, {}};
  map.channels = entry[24];
  map.type = static_cast<SampleType>(field(25, kSampleTypeNames.size() - 1, "sample_type"));
  map.colour_space = static_cast<ColourSpace>(field(26, kColourSpaceNames.size() - 1, "colour_space"));
  map.alpha = static_cast<Alpha>(field(27, 2, "alpha"));
  if (map.channels < 1 || map.channels > 4) {
    return invalid("H3", 0,
                   fmt::format("HEAD: map '{}' has {} channels, expected 1 to 4", map.name, map.channels));
  }
  if (!field.fault.empty()) return invalid("H5", 0, field.fault);
  if (load_u32(&entry[28]) != 0) return invalid("H5", 0, "HEAD: a map's reserved field is not 0");
  return map;
}

}  // namespace

const char* name_of(SampleType type) { return kSampleTypeNames[static_cast<std::size_t>(type)]; }
const char* name_of(ColourSpace space) { return kColourSpaceNames[static_cast<std::size_t>(space)]; }
const char* name_of(Quantity quantity) { return kQuantityNames[static_cast<std::size_t>(quantity)]; }

std::optional<ColourSpace> colour_space_of(std::string_view name) {
  return find_name<ColourSpace>(kColourSpaceNames, name);
}

std::optional<Quantity> quantity_of(std::string_view name) {
  return find_name<Quantity>(kQuantityNames, name);
}

std::uint32_t Head::channels() const {
  std::uint32_t sum = 0;
  for (const Map& map : maps) sum += map.channels;
  return sum;
}

std::optional<std::uint32_t> Head::find_map(std::string_view name) const {
  for (std::uint32_t i = 0; i < maps.size(); ++i) {
    if (maps[i].name == name) return i;
  }
  return std::nullopt;
}

bool valid_map_name(std::string_view text) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !text.empty() && text.size() <= kNameBytes && std::all_of(text.begin(), text.end(), good);
}

Bytes write_head(const Head& head) {
  Bytes raw(kFixedBytes + kMapBytes * head.maps.size());
  store_u32(&raw[0], static_cast<std::uint32_t>(head.model));
  store_u32(&raw[4], head.width);
  store_u32(&raw[8], head.height);
  store_u32(&raw[12], head.views);
  store_u32(&raw[16], head.lights);
  store_u32(&raw[20], head.pairs);
  raw[24] = static_cast<std::uint8_t>(head.maps.size());
  raw[25] = static_cast<std::uint8_t>(head.channels());
  raw[26] = static_cast<std::uint8_t>(head.wrap_u);
  raw[27] = static_cast<std::uint8_t>(head.wrap_v);
  raw[28] = head.unbounded ? 1 : 0;
  raw[29] = static_cast<std::uint8_t>(head.quantity);
  raw[30] = static_cast<std::uint8_t>(head.value_transform);
  for (std::size_t i = 0; i < head.maps.size(); ++i) {
    const Map& map = head.maps[i];
    std::uint8_t* entry = &raw[kFixedBytes + kMapBytes * i];
    std::copy(map.name.begin(), map.name.end(), entry);
    entry[24] = static_cast<std::uint8_t>(map.channels);
    entry[25] = static_cast<std::uint8_t>(map.type);
    entry[26] = static_cast<std::uint8_t>(map.colour_space);
    entry[27] = static_cast<std::uint8_t>(map.alpha);
  }
  return raw;
}

Result<Head> read_head(ByteView raw) {
  if (raw.size() < kFixedBytes || raw.size() != kFixedBytes + kMapBytes * raw[24]) {
    return invalid("H1", 0, fmt::format("HEAD has {} bytes, expected 32 + 32 a map", raw.size()));
  }
  Head head;
  const std::uint32_t model = load_u32(&raw[0]);
  if (find_model(static_cast<ModelId>(model)) == nullptr) {
    return unsupported("H2", 0, fmt::format("HEAD names model {}, which this version does not know", model));
  }
  head.model = static_cast<ModelId>(model);

  const auto in_range = [&](std::size_t at, std::uint32_t& value, std::uint32_t last) {
    value = load_u32(&raw[at]);
    return value >= 1 && value <= last;
  };
  if (!in_range(4, head.width, kMaxSide) || !in_range(8, head.height, kMaxSide)) {
    return invalid("H3", 0,
                   fmt::format("HEAD: size {}x{}, expected 1 to 65536 a side", head.width, head.height));
  }
  if (!in_range(12, head.views, kMaxDirections) || !in_range(16, head.lights, kMaxDirections) ||
      !in_range(20, head.pairs, kMaxPairs)) {
    return invalid("H3", 0, "HEAD: view, light or pair count out of range");
  }
  const unsigned map_count = raw[24];
  if (map_count < 1 || map_count > kMaxMaps) {
    return invalid("H3", 0, fmt::format("HEAD: {} maps, expected 1 to {}", map_count, kMaxMaps));
  }

  EnumReader field{raw, {}};
  head.wrap_u = static_cast<Wrap>(field(26, 1, "wrap_u"));
  head.wrap_v = static_cast<Wrap>(field(27, 1, "wrap_v"));
  head.unbounded = field(28, 1, "unbounded") != 0;
  head.quantity = static_cast<Quantity>(field(29, kQuantityNames.size() - 1, "quantity"));
  head.value_transform = static_cast<ValueTransform>(field(30, 2, "value_transform"));
  field(31, 0, "reserved");
  if (!field.fault.empty()) return invalid("H5", 0, field.fault);

  for (std::size_t i = 0; i < map_count; ++i) {
    Result<Map> map = read_map(raw.subspan(kFixedBytes + kMapBytes * i, kMapBytes), i);
    if (!map) return map.error();
    if (head.find_map(map->name)) {
      return invalid("H6", 0, fmt::format("HEAD: two maps are named '{}'", map->name));
    }
    if (map->alpha != Alpha::none && map->channels == 1) {
      return invalid("H7", 0, fmt::format("HEAD: map '{}' has one channel and alpha", map->name));
    }
    head.maps.push_back(*std::move(map));
  }
  if (head.channels() != raw[25] || head.channels() > kMaxChannels) {
    return invalid("H4", 0,
                   fmt::format("HEAD: channel_count is {}, the maps have {} (at most {})", raw[25],
                               head.channels(), kMaxChannels));
  }
  return head;
}

}  // namespace btfc
