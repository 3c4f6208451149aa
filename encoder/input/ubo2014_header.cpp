// Layout: the authors' library for these files, btflib (University of Bonn, 2014-2016).
#include "encoder/input/ubo2014_header.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>

#include "encoder/dataset/dataset.h"
#include "format/limits.h"

namespace btfc {
namespace {

struct Signature {
  std::string_view text;
  Ubo2014Body body;
  bool rotations;
  bool extended;
};
// Where one is the beginning of another, the longer one comes first.
constexpr Signature kSignatures[] = {
    {"!DFMF08FCR", Ubo2014Body::dfmf, true, false}, {"!FMF12FCER", Ubo2014Body::fmf, true, true},
    {"!FMF06FCR", Ubo2014Body::fmf, true, false},   {"!FMF06FC", Ubo2014Body::fmf, false, false},
    {"!PVF06FCR", Ubo2014Body::pvf, true, false},   {"!PVF06FC", Ubo2014Body::pvf, false, false},
    {"!BDIF06R2!", Ubo2014Body::bdi, false, false},
};
constexpr std::size_t kNameBytes = 80;
// First word of a PVF file older than the meta block.
constexpr std::uint32_t kOldPvf = 301074;

const Signature* signature_of(ByteView bytes) {
  const std::string_view begin(reinterpret_cast<const char*>(bytes.data()),
                               std::min<std::size_t>(bytes.size(), 10));
  for (const Signature& each : kSignatures) {
    if (begin.substr(0, each.text.size()) == each.text) return &each;
  }
  return nullptr;
}

bool is_number(const std::string& text) {
  double value = 0;
  char* end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == 0 && std::isfinite(value);
}

void read_channels(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  const std::uint32_t count = cursor.u32("the number of channels");
  if (!cursor.failed() && (count < 1 || count > kMaxDatasetChannels)) {
    cursor.refuse(fmt::format("{} channels, expected 1 to {}", count, kMaxDatasetChannels));
  }
  for (std::uint32_t c = 0; c < count && !cursor.failed(); ++c) {
    const std::uint32_t size = cursor.u32("a channel's name");
    const std::uint64_t offset = cursor.skip(size, "a channel's name");
    if (cursor.failed()) return;
    std::string name(reinterpret_cast<const char*>(cursor.data(offset)), size);
    name.erase(std::find(name.begin(), name.end(), '\0'), name.end());
    const bool printable = std::all_of(name.begin(), name.end(), [](char x) { return x > ' ' && x <= '~'; });
    if (name.empty() || name.size() > 255 || !printable) {
      cursor.refuse(fmt::format("channel {} has no name of 1 to 255 printable characters", c));
    }
    header.channels.push_back(std::move(name));
  }
}

void name_channels(Ubo2014Header& header) {
  const std::vector<std::string> rgb = {"R", "G", "B"};
  header.rgb =
      header.channels.size() == 3 && !std::all_of(header.channels.begin(), header.channels.end(), is_number);
  if (!header.rgb || header.channels == rgb) return;
  header.notes.push_back(fmt::format("the channels '{}' are taken as R, G, B",  //
                                     fmt::join(header.channels, "', '")));
  header.channels = rgb;
}

void read_meta(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  const std::uint64_t begin = cursor.at();
  const std::uint32_t size = cursor.u32("the meta block");
  if (header.body == Ubo2014Body::pvf && size == kOldPvf) {
    cursor.refuse_unsupported("a PVF file older than the meta block, which is not supported");
  }
  const std::uint32_t version = cursor.u32("the meta block");
  cursor.skip(3 * kNameBytes, "the names of setup, sensor and light source");
  cursor.f32("the resolution");
  float scale[3];
  for (float& each : scale) each = cursor.f32("the RGB scale");
  if (version > 1) {
    const bool cosine = cursor.u32("the cosine flag") != 0;
    header.quantity = cosine ? Quantity::reflectance_cos : Quantity::reflectance;
  }
  if (version > 2) cursor.skip(cursor.u32("the size of the XML"), "the XML");
  if (version > 3) {
    read_channels(cursor, header);
  } else {
    header.channels = {"R", "G", "B"};
  }
  if (!cursor.failed() && cursor.at() - begin != size) {
    cursor.refuse(fmt::format("the meta block has {} bytes, but says it has {}", cursor.at() - begin, size));
  }
  if (cursor.failed()) return;
  name_channels(header);
  // The authors' reader does not apply it either.
  if (scale[0] != 1 || scale[1] != 1 || scale[2] != 1) {
    header.notes.push_back(
        fmt::format("the RGB scale {}, {}, {} is not applied to the values", scale[0], scale[1], scale[2]));
  }
}

// One direction of `what`, two floats: polar angle and azimuth in radians.
Direction load_direction(Ubo2014Cursor& cursor, std::uint64_t offset, const std::string& what) {
  const double theta = load_f32(cursor.data(offset)), phi = load_f32(cursor.data(offset + 4));
  if (!std::isfinite(theta) || !std::isfinite(phi)) {
    cursor.refuse(fmt::format("{} has the angles {}, {}, expected finite ones", what, theta, phi));
    return {};
  }
  // Single precision may step over pi/2 by a little.
  if (theta < 0 || theta > std::numbers::pi / 2 + 1e-6) {
    cursor.refuse(fmt::format("{} is ({}, {}) degrees and lies below the surface, expected theta 0 to 90",
                              what, degrees(theta), degrees(phi)));
    return {};
  }
  return direction_from_degrees(degrees(theta), degrees(phi));
}

// Two numbers of the list with the same direction, the lower first.
std::optional<std::pair<std::size_t, std::size_t>> find_repeated(const std::vector<Direction>& list) {
  // Along a skew axis hardly two directions of a sampling have the same place, so that each is compared with
  // few others.
  std::vector<double> place(list.size());
  std::transform(list.begin(), list.end(), place.begin(), [](const Direction& d) {
    const Vector3 v = unit_vector(d);
    return 0.64 * v[0] + 0.36 * v[1] + 0.68 * v[2];
  });
  std::vector<std::size_t> order(list.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return place[a] < place[b]; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size() && place[order[j]] - place[order[i]] < 2e-5; ++j) {
      if (same_direction(list[order[i]], list[order[j]])) return std::minmax({order[i], order[j]});
    }
  }
  return std::nullopt;
}

void refuse_repeated(Ubo2014Cursor& cursor, const std::vector<Direction>& list, const char* what) {
  if (const auto found = find_repeated(list)) {
    cursor.refuse(fmt::format("{} {} {} and {} {} have the same direction", what, found->first,
                              to_text(list[found->first]), found->second, to_text(list[found->second])));
  }
}

std::uint32_t read_direction_count(Ubo2014Cursor& cursor, const std::string& what) {
  const std::uint32_t count = cursor.u32("the number of " + what);
  if (!cursor.failed() && (count < 1 || count > kMaxDirections)) {
    cursor.refuse(fmt::format("{} {}, expected 1 to {}", count, what, kMaxDirections));
  }
  return cursor.failed() ? 0 : count;
}

void read_directions(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  const std::uint32_t views = read_direction_count(cursor, "views");
  std::uint64_t first_lights = 0;
  for (std::uint32_t v = 0; v < views && !cursor.failed(); ++v) {
    const std::string view = fmt::format("view {}", v);
    const std::uint64_t own = cursor.skip(8, view);
    if (cursor.failed()) return;
    header.views.push_back(load_direction(cursor, own, view));
    const std::uint32_t count = read_direction_count(cursor, fmt::format("lights of view {}", v));
    const std::uint64_t lights = cursor.skip(CheckedSize(count) * 8, "the lights of " + view);
    if (cursor.failed()) return;
    if (v == 0) {
      first_lights = lights;
      for (std::uint32_t l = 0; l < count && !cursor.failed(); ++l) {
        header.lights.push_back(load_direction(cursor, lights + 8 * l, fmt::format("light {}", l)));
      }
      continue;
    }
    if (count != header.lights.size()) {
      cursor.refuse(fmt::format("view {} has {} lights and view 0 has {}, expected the same for all", v,
                                count, header.lights.size()));
      return;
    }
    if (std::equal(cursor.data(lights), cursor.data(lights) + 8 * std::size_t{count},
                   cursor.data(first_lights))) {
      continue;
    }
    for (std::uint32_t l = 0; l < count && !cursor.failed(); ++l) {
      const Direction own_light =
          load_direction(cursor, lights + 8 * l, fmt::format("light {} of view {}", l, v));
      if (!cursor.failed() && !same_direction(own_light, header.lights[l])) {
        cursor.refuse(fmt::format("light {} of view {} is {} and that of view 0 is {}, expected the same", l,
                                  v, to_text(own_light), to_text(header.lights[l])));
      }
    }
  }
  if (cursor.failed()) return;
  if (header.pairs() > kMaxPairs) {
    cursor.refuse(fmt::format("{} views x {} lights, expected at most {} images", views, header.lights.size(),
                              kMaxPairs));
  }
  refuse_repeated(cursor, header.views, "view");
  refuse_repeated(cursor, header.lights, "light");
}

}  // namespace

bool has_ubo2014_signature(ByteView bytes) { return signature_of(bytes) != nullptr; }

void read_ubo2014_rotations(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  const std::uint32_t count = cursor.u32("the number of rotations");
  const std::uint64_t begin = cursor.skip(CheckedSize(count) * 36, "the rotations");
  if (cursor.failed() || count == 0) return;
  for (std::uint64_t i = 0; i < 9 * std::uint64_t{count}; ++i) {
    if (std::isfinite(load_f32(cursor.data(begin + 4 * i)))) continue;
    cursor.refuse(fmt::format("rotation {} has a number that is not finite", i / 9));
    return;
  }
  header.notes.push_back(fmt::format("{} rotations of local frames are left out", count));
}

Ubo2014Header read_ubo2014_header(Ubo2014Cursor& cursor) {
  Ubo2014Header header;
  const Signature* signature = signature_of(ByteView(cursor.data(0), cursor.left()));
  if (signature == nullptr) {
    cursor.refuse("no signature of a Bonn BTF file, expected '!DFMF08FCR' or another one");
    return header;
  }
  header.body = signature->body;
  header.extended = signature->extended;
  cursor.skip(signature->text.size(), "the signature");
  read_meta(cursor, header);
  if (!cursor.failed()) read_directions(cursor, header);
  header.width = cursor.u32("the image size");
  header.height = cursor.u32("the image size");
  if (!cursor.failed() &&
      (header.width < 1 || header.height < 1 || header.width > kMaxSide || header.height > kMaxSide)) {
    cursor.refuse(fmt::format("images of {}x{} texels, expected 1 to {} a side", header.width, header.height,
                              kMaxSide));
  }
  if (signature->rotations && !cursor.failed()) read_ubo2014_rotations(cursor, header);
  return header;
}

}  // namespace btfc
