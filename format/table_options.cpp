// Options -> HEAD for the models of a BTF's directions.
#include "format/table_options.h"

#include <fmt/format.h>

#include "format/directions.h"
#include "format/limits.h"

namespace btfc {

Result<Head> table_head(ModelId model, const OptionValues& options) {
  const auto size = parse_pair(options, "size", 1, kMaxSide, true);
  if (!size) return size.error();
  if (!*size) return bad_argument("--size WxH is missing");
  const auto views = parse_u32(options, "views", 1, kMaxTableDirections);
  if (!views) return views.error();
  const auto lights = parse_u32(options, "lights", 1, kMaxTableDirections);
  if (!lights) return lights.error();
  const auto both = parse_u32(options, "directions", 1, kMaxTableDirections);
  if (!both) return both.error();
  if (*both && (*views || *lights))
    return bad_argument("--directions stands in place of --views and --lights");
  const auto pairs = parse_u32(options, "pairs", 1, kMaxPairs);
  if (!pairs) return pairs.error();
  const auto channels = parse_u32(options, "channels", 1, 4);
  if (!channels) return channels.error();
  constexpr const char* kBits[] = {"8", "16"};
  const auto bits = parse_choice(options, "bits", kBits);
  if (!bits) return bits.error();

  Head head;
  head.model = model;
  head.width = (*size)->first;
  head.height = (*size)->second;
  head.views = views->value_or(both->value_or(81));
  head.lights = lights->value_or(both->value_or(81));
  head.pairs = pairs->value_or(head.views * head.lights);
  Map map;
  map.channels = channels->value_or(3);
  map.type = bits->value_or(0) == 0 ? SampleType::unorm8 : SampleType::unorm16;
  head.maps = {map};
  if (const auto checked = check_table_head(head); !checked) return as_usage(checked.error());
  return head;
}

Result<Done> check_table_head(const Head& head) {
  if (const auto counts = check_direction_counts(head); !counts) return counts.error();
  if (head.unbounded || head.value_transform != ValueTransform::identity)
    return invalid("V5", 0, "HEAD says unbounded or has a value transform, which the model does not know");
  return Done{};
}

PaperCount table_paper(const char* name, const Head& head, std::uint64_t values) {
  const std::uint64_t tile = std::uint64_t{head.channels()} * head.width * head.height * head.pairs;
  return {name,
          32 * values,
          {{"values", std::to_string(values)},
           {"tile_values", std::to_string(tile)},
           {"ratio", fmt::format("{:.6g}", static_cast<double>(tile) / static_cast<double>(values))}}};
}

Error as_usage(Error error) {
  error.status = Status::bad_argument;
  error.rule = "";
  return error;
}

}  // namespace btfc
