// The options of model patch: their meaning, their defaults, and what `btfc size` makes of them.
#include <fmt/format.h>

#include <algorithm>

#include "format/limits.h"
#include "format/models/patch_payload.h"

namespace btfc {
namespace {

constexpr const char* kBlends[] = {"liang", "quilting"};
constexpr const char* kPacks[] = {"rgba8", "packed"};

const OptionSpec kSizeOptions[] = {
    {"sample", "WxH", "sample of W x H texels (required)"},
    {"channels", "N", "channels of the one map, 1 to 4 (default 3)"},
    {"bits", "8|16", "bits a sample (default 8)"},
    {"size", "WxH", "texture size (default: all that the patches cover)"},
    {"k", "N|NxM", "patches a side (default: as --size needs)"},
    {"wb", "N", "patch size w_B in texels (default 3/8 of the sample's shorter side)"},
    {"we", "N", "overlap w_E in texels, 1 to w_B/2 (default w_B/6)"},
    {"blend", "liang|quilting", "how patches join (default quilting)"},
    {"pack", "rgba8|packed", "how cuts are stored (default packed)"},
};

// Patches needed for `side` texels.
std::uint32_t patches_for(std::uint64_t side, const PatchShape& s) {
  if (side <= s.size) return 1;
  return static_cast<std::uint32_t>((side - s.overlap + s.step() - 1) / s.step());
}

// The rule's number means nothing to somebody who typed an option.
Error as_usage(Error error) {
  error.status = Status::bad_argument;
  error.rule = "";
  return error;
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
  // Half to a quarter of the sample, and w_B/6, is what the paper recommends (section III.A).
  s.size = wb->value_or(std::max(2u, shorter * 3 / 8));
  s.overlap = we->value_or(std::max(1u, s.size / 6));
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
  head.width = *size ? (*size)->first : static_cast<std::uint32_t>(s.full_width());
  head.height = *size ? (*size)->second : static_cast<std::uint32_t>(s.full_height());
  if (const Result<Done> checked = check_patch_shape(s, head); !checked) return as_usage(checked.error());
  return s;
}

Result<ItemDescription> patch_describe(const OptionValues& options) {
  const auto sample = parse_pair(options, "sample", 1, kMaxSide, false);
  if (!sample) return sample.error();
  if (!*sample) return bad_argument("--sample WxH is missing");
  const auto channels = parse_u32(options, "channels", 1, 4);
  if (!channels) return channels.error();
  constexpr const char* kBits[] = {"8", "16"};
  const auto bits = parse_choice(options, "bits", kBits);
  if (!bits) return bits.error();

  Head head;
  Map map;
  map.channels = channels->value_or(3);
  map.type = bits->value_or(0) == 0 ? SampleType::unorm8 : SampleType::unorm16;
  head.maps = {map};
  const Result<PatchShape> shape =
      patch_shape_from_options(options, (*sample)->first, (*sample)->second, head);
  if (!shape) return shape.error();
  return ItemDescription{head, write_patch_parm(*shape)};
}

}  // namespace btfc
