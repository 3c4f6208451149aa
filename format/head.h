// HEAD: what a file holds, whatever its model (spec/btfc.md section 5.1).
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

enum class ModelId : std::uint32_t {
  patch = 1,
  gm = 2,
  car = 3,
  ptm = 4,
  plm = 5,
  pcarf = 6,
  pca = 7,
  lpca = 8,
  gmrf = 9,
  car3d = 10,
};

enum class SampleType : std::uint8_t { unorm8 = 0, unorm16 = 1, float16 = 2 };
enum class ColourSpace : std::uint8_t {
  unknown = 0,
  srgb_rec709_scene = 1,
  lin_rec709_scene = 2,
  lin_ap0_scene = 3,
  lin_ap1_scene = 4,
  lin_ciexyzd65_scene = 5,
  data = 6,
};
enum class Quantity : std::uint8_t { unspecified, reflectance, reflectance_cos, radiance, data };
enum class ValueTransform : std::uint8_t { identity, srgb, log };
enum class Alpha : std::uint8_t { none, straight, premultiplied };
enum class Wrap : std::uint8_t { clamp, repeat };

constexpr std::uint32_t sample_bits(SampleType type) { return type == SampleType::unorm8 ? 8 : 16; }
const char* name_of(SampleType type);
const char* name_of(ColourSpace space);
const char* name_of(Quantity quantity);
std::optional<ColourSpace> colour_space_of(std::string_view name);
std::optional<Quantity> quantity_of(std::string_view name);

// A named image of one to four channels.
struct Map {
  std::string name = "image";
  std::uint32_t channels = 3;
  SampleType type = SampleType::unorm8;
  ColourSpace colour_space = ColourSpace::unknown;
  Alpha alpha = Alpha::none;
  bool operator==(const Map&) const = default;
};

struct Head {
  ModelId model = ModelId::patch;
  std::uint32_t width = 0, height = 0;  // texels
  std::uint32_t views = 1, lights = 1, pairs = 1;
  Wrap wrap_u = Wrap::clamp, wrap_v = Wrap::clamp;
  bool unbounded = false;
  Quantity quantity = Quantity::unspecified;
  ValueTransform value_transform = ValueTransform::identity;
  std::vector<Map> maps;
  bool operator==(const Head&) const = default;

  std::uint32_t channels() const;
  std::uint64_t texels() const { return std::uint64_t{width} * height; }
  // Number of the map with that name, or none.
  std::optional<std::uint32_t> find_map(std::string_view name) const;
};

// Whether text is a valid map name (rule H6).
bool valid_map_name(std::string_view text);

// The HEAD chunk's bytes. The head must keep rules H2 to H7; write then read gives the same head.
Bytes write_head(const Head& head);

// Rules H1 to H7. Thread-safe, no side effects.
Result<Head> read_head(ByteView raw);

}  // namespace btfc
