// Options -> HEAD, and the begin of chunks and words, for the models of a BTF's directions.
#include "format/table_model.h"

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

CostTerms cost_terms(const Head& head) {
  return {head.maps[0].channels, std::min(head.views, 3u), std::min(head.lights, 3u),
          head.pairs < std::uint64_t{head.views} * head.lights ? 1u : 0u};
}

PaperCount survey_count(const Head& head, std::uint64_t values) {
  const std::uint64_t tile = std::uint64_t{head.channels()} * head.texels() * head.pairs;
  return {"Filip, Haindl 2009 (survey), Table 6, 32 bits a value",
          32 * values,
          {{"values", std::to_string(values)},
           {"tile_values", std::to_string(tile)},
           {"ratio", fmt::format("{:.6g}", static_cast<double>(tile) / static_cast<double>(values))}}};
}

Result<TablePrecisions> parse_precisions(const OptionValues& options) {
  const auto texels = parse_precision(options, "precision", Precision::f32);
  if (!texels) return texels.error();
  const auto tables = parse_precision(options, "table-precision", *texels);
  if (!tables) return tables.error();
  return TablePrecisions{*texels, *tables};
}

std::vector<RawChunk> table_chunks(const Head& head, const Directions& directions, Bytes parm) {
  return {{{kHead, kCritical}, write_head(head)},
          {{kDirs, kCritical}, write_directions(directions)},
          {{kParm, kPayloadChunk}, std::move(parm)}};
}

Result<DirectionWords> begin_table_item(const Head& head, const ChunkReader& read, LoadedItem& item) {
  item.head = head;
  const Result<Bytes> raw = read({kDirs, kCritical});
  if (!raw) return raw.error();
  Result<Directions> directions = read_directions(head, *raw);
  if (!directions) return directions.error();
  item.directions = *std::move(directions);
  return append_direction_words(item.directions, item.words[0]);
}

Result<CodedRows> read_rows(const ChunkReader& read, const ChunkKey& key, std::uint64_t rows,
                            std::uint64_t columns, Precision precision, const char* rule) {
  const Result<Bytes> raw = read(key);
  if (!raw) return raw.error();
  return read_coded_rows(*raw, rows, columns, precision, rule,
                         fmt::format("{} of level {}, tile {}", type_name(key.type), key.level, key.tile));
}

Error as_usage(Error error) {
  error.status = Status::bad_argument;
  error.rule = "";
  return error;
}

}  // namespace btfc
