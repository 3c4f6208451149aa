// The options of model patch: their meaning, their defaults, and what `btfc size` makes of them.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <optional>

#include "format/limits.h"
#include "format/models/patch_payload.h"
#include "format/table_model.h"

namespace btfc {
namespace {

constexpr const char* kBlends[] = {"liang", "quilting"};
constexpr const char* kPacks[] = {"rgba8", "packed"};

const OptionSpec kSizeOptions[] = {
    {"sample", "WxH", "sample of W x H texels (required)"},
    {"channels", "N", "channels of the one map, 1 to 4 (default 3)"},
    {"bits", "8|16", "bits a sample of the one map (default 8)"},
    {"maps", "NxB,…", "several maps, each N channels of B bits: 3x8,3x8,1x16"},
    {"size", "WxH", "texture size (default: all that the patches cover)"},
    {"k", "N|NxM", "patches a side (default: as --size needs)"},
    {"wb", "N", "patch size w_B in texels (default 3/8 of the sample's shorter side)"},
    {"we", "N", "overlap w_E in texels, 1 to w_B/2 (default w_B/6)"},
    {"blend", "liang|quilting", "how patches join (default quilting)"},
    {"pack", "rgba8|packed", "how cuts are stored (default packed)"},
    {"tileable", nullptr, "a texture that wraps, k (w_B - w_E) texels a side"},
    {"stored-blocks", "N", "a trimmed sample of N blocks of 4x4 texels (default: stored whole)"},
};

// Patches needed for `side` texels.
std::uint32_t patches_for(std::uint64_t side, const PatchShape& s) {
  if (s.wraps) return static_cast<std::uint32_t>(std::max<std::uint64_t>(1, side / s.step()));
  if (side <= s.size) return 1;
  return static_cast<std::uint32_t>((side - s.overlap + s.step() - 1) / s.step());
}

// Half to a quarter of the sample, and w_B/6, is what the paper recommends (section III.A).
std::uint32_t automatic_size(std::uint32_t shorter) { return std::max(2u, shorter * 3 / 8); }
std::uint32_t automatic_overlap(std::uint32_t size) { return std::max(1u, size / 6); }

// A wrapping texture of a given size: the step must divide both sides. Of the steps that do, with what the
// user has fixed, the one whose patch size is nearest to the automatic one. False where there is none.
bool fit_step(PatchShape& s, std::uint32_t common, std::optional<std::uint32_t> size,
              std::optional<std::uint32_t> overlap) {
  const std::uint32_t shorter = std::min(s.sample_width, s.sample_height);
  const std::int64_t wanted = automatic_size(shorter);
  std::int64_t best = INT64_MAX;
  for (std::uint32_t step = 1; step <= common && step < shorter; ++step) {
    if (common % step != 0 || (size && *size <= step)) continue;
    const std::uint32_t we = size ? *size - step : overlap.value_or(std::max(1u, step / 5));
    const std::uint32_t wb = step + we;
    if (we < 1 || we > wb / 2 || wb > shorter || (overlap && *overlap != we)) continue;
    // With the size fixed, the overlap nearest to its automatic value.
    const std::int64_t off = size ? std::int64_t{we} - automatic_overlap(wb) : std::int64_t{wb} - wanted;
    if (std::abs(off) >= best) continue;
    best = std::abs(off);
    s.size = wb;
    s.overlap = we;
  }
  return best != INT64_MAX;
}

Result<std::vector<Map>> maps_of(const OptionValues& options) {
  const auto channels = parse_u32(options, "channels", 1, 4);
  if (!channels) return channels.error();
  constexpr const char* kBits[] = {"8", "16"};
  const auto bits = parse_choice(options, "bits", kBits);
  if (!bits) return bits.error();
  const auto list = find_option(options, "maps");
  const auto map_of = [](std::string name, std::uint32_t n, std::uint32_t width) {
    Map map;
    map.name = std::move(name);
    map.channels = n;
    map.type = width == 8 ? SampleType::unorm8 : SampleType::unorm16;
    return map;
  };
  if (!list) return std::vector<Map>{map_of("image", channels->value_or(3), bits->value_or(0) == 0 ? 8 : 16)};
  if (*channels || *bits)
    return bad_argument("--maps stands in place of --channels and --bits, not beside them");

  std::vector<Map> maps;
  for (std::size_t begin = 0; begin <= list->size();) {
    const std::size_t end = std::min(list->find(',', begin), list->size());
    const auto numbers = split_numbers(list->substr(begin, end - begin), 'x');
    if (!numbers || numbers->size() != 2 || (*numbers)[0] < 1 || (*numbers)[0] > 4 ||
        ((*numbers)[1] != 8 && (*numbers)[1] != 16) || maps.size() == kMaxMaps) {
      return bad_argument(fmt::format(
          "--maps is '{}', expected up to 16 of NxB with 1 to 4 channels of 8 or 16 bits", *list));
    }
    maps.push_back(map_of(fmt::format("map{}", maps.size()), (*numbers)[0], (*numbers)[1]));
    begin = end + 1;
  }
  return maps;
}

}  // namespace

const std::span<const OptionSpec> kPatchSizeOptions = kSizeOptions;

Result<PatchShape> patch_shape_from_options(const OptionValues& options, std::uint32_t sample_width,
                                            std::uint32_t sample_height, Head& head) {
  const auto k = parse_pair(options, "k", 1, kMaxSide, true);
  if (!k) return k.error();
  const auto size = parse_pair(options, "size", 1, kMaxSide, false);
  if (!size) return size.error();
  const auto wb = parse_u32(options, "wb", 2, kMaxSide);
  if (!wb) return wb.error();
  const auto we = parse_u32(options, "we", 0, kMaxSide / 2);
  if (!we) return we.error();
  const auto blend = parse_choice(options, "blend", kBlends);
  if (!blend) return blend.error();
  const auto pack = parse_choice(options, "pack", kPacks);
  if (!pack) return pack.error();
  if (!*k && !*size) return bad_argument("neither --size nor --k is given, expected at least one of them");

  PatchShape s;
  s.sample_width = sample_width;
  s.sample_height = sample_height;
  const std::uint32_t shorter = std::min(sample_width, sample_height);
  if (shorter < 2) {
    return bad_argument(
        fmt::format("the sample is {}x{}, expected at least 2x2", sample_width, sample_height));
  }
  s.wraps = find_option(options, "tileable").has_value();
  s.size = wb->value_or(automatic_size(shorter));
  s.overlap = we->value_or(automatic_overlap(s.size));
  s.blend = static_cast<PatchBlend>(blend->value_or(1));
  if (s.blend == PatchBlend::liang && *pack)
    return bad_argument("--pack is for --blend quilting, liang stores no cuts");
  s.cuts = s.blend == PatchBlend::liang ? CutLayout::none : static_cast<CutLayout>(pack->value_or(1) + 1);
  if (s.size > shorter) {
    return bad_argument(fmt::format("--wb is {}, but a sample of {}x{} texels allows 2 to {}", s.size,
                                    sample_width, sample_height, shorter));
  }
  if (s.overlap > s.size / 2) {
    return bad_argument(fmt::format("--we is {}, but --wb {} allows 1 to {}", s.overlap, s.size, s.size / 2));
  }
  if (s.wraps && *size && !*k && !fit_step(s, std::gcd((*size)->first, (*size)->second), *wb, *we)) {
    return bad_argument(
        fmt::format("no patches of {} and overlap of {} tile {}x{} texels: w_B - w_E must divide both sides",
                    *wb ? std::to_string(**wb) : "any size", *we ? std::to_string(**we) : "any width",
                    (*size)->first, (*size)->second));
  }
  s.count_x = *k ? (*k)->first : patches_for((*size)->first, s);
  s.count_y = *k ? (*k)->second : patches_for((*size)->second, s);
  if (s.overlap == 0 && s.patches() > 1) {
    return bad_argument(fmt::format("--we is 0, which {}x{} patches do not allow, expected 1 to {}",
                                    s.count_x, s.count_y, s.size / 2));
  }
  if (!*size && (s.full_width() > kMaxSide || s.full_height() > kMaxSide)) {
    return bad_argument(fmt::format("{}x{} patches give {}x{} texels, expected at most 65536 a side",
                                    s.count_x, s.count_y, s.full_width(), s.full_height()));
  }
  head.model = ModelId::patch;
  head.wrap_u = head.wrap_v = s.wraps ? Wrap::repeat : Wrap::clamp;
  head.width = *size ? (*size)->first : static_cast<std::uint32_t>(s.full_width());
  head.height = *size ? (*size)->second : static_cast<std::uint32_t>(s.full_height());
  if (const Result<Done> checked = check_patch_shape(s, head); !checked) return as_usage(checked.error());
  return s;
}

Result<ItemDescription> patch_describe(const OptionValues& options) {
  const auto sample = parse_pair(options, "sample", 1, kMaxSide, false);
  if (!sample) return sample.error();
  if (!*sample) return bad_argument("--sample WxH is missing");
  const auto maps = maps_of(options);
  if (!maps) return maps.error();
  const auto stored_blocks = parse_u32(options, "stored-blocks", 1, kMaxSide);
  if (!stored_blocks) return stored_blocks.error();

  Head head;
  head.maps = *maps;
  Result<PatchShape> shape = patch_shape_from_options(options, (*sample)->first, (*sample)->second, head);
  if (!shape) return shape.error();
  shape->stored_blocks = stored_blocks->value_or(0);
  if (const Result<Done> checked = check_patch_shape(*shape, head); !checked)
    return as_usage(checked.error());
  return ItemDescription{head, write_patch_parm(*shape)};
}

}  // namespace btfc
