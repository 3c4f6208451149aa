// What the models of a BTF's directions share: options of `btfc size`, what they ask of HEAD, and how their
// chunks and words begin.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "format/coded_rows.h"
#include "format/model_table.h"
#include "format/options.h"
#include "format/result.h"

namespace btfc {

inline constexpr OptionSpec kTableSizeOptions[] = {
    {"size", "N|WxH", "texels of the tile (required)"},
    {"directions", "N", "as many views as lights, in place of --views and --lights"},
    {"views", "N", "number of views (default 81)"},
    {"lights", "N", "number of lights (default 81)"},
    {"pairs", "N", "number of pairs of a view and a light (default: all)"},
    {"channels", "N", "channels of the one map, 1 to 4 (default 3)"},
    {"bits", "8|16", "bits a sample of the original (default 8)"},
};

// kTableSizeOptions and a model's own.
template <std::size_t N>
constexpr auto with_table_options(const OptionSpec (&own)[N]) {
  std::array<OptionSpec, std::size(kTableSizeOptions) + N> all{};
  std::copy_n(own, N, std::copy_n(kTableSizeOptions, std::size(kTableSizeOptions), all.begin()));
  return all;
}

// The HEAD that these options describe.
Result<Head> table_head(ModelId model, const OptionValues& options);

// An error about numbers that somebody typed: without the rule's number.
Error as_usage(Error error);

// `btfc size` of such a model: shape_for(head) makes of the options what write turns into PARM, and read
// holds it against the model's rules.
template <class ShapeFor, class Write, class Read>
Result<ItemDescription> describe_table(ModelId model, const OptionValues& options, const ShapeFor& shape_for,
                                       const Write& write, const Read& read) {
  const Result<Head> head = table_head(model, options);
  if (!head) return head.error();
  const auto shape = shape_for(*head);
  if (!shape) return shape.error();
  const Bytes parm = write(*shape);
  if (const auto checked = read(*head, parm); !checked) return as_usage(checked.error());
  return ItemDescription{*head, parm};
}

// Rules V1 and V5: counts fit for tables, not unbounded, no value transform.
Result<Done> check_table_head(const Head& head);

// What of HEAD a texel's cost depends on (spec/tables.md section 6).
struct CostTerms {
  std::uint64_t channels;       // s, of the first map
  std::uint64_t views, lights;  // a and b: corners that have a weight
  std::uint64_t pair;           // q: words that are read to number a pair
};
CostTerms cost_terms(const Head& head);

// The survey's Table 6: a count of values of 32 bits, and the ratio of the tile's values to it.
PaperCount survey_count(const Head& head, std::uint64_t values);

// --precision (default f32) and --table-precision (default: as --precision).
struct TablePrecisions {
  Precision texels = Precision::f32, tables = Precision::f32;
};
Result<TablePrecisions> parse_precisions(const OptionValues& options);

// The chunks with which a file begins: HEAD, DIRS, PARM.
std::vector<RawChunk> table_chunks(const Head& head, const Directions& directions, Bytes parm);

// Reads DIRS into an item and puts its tables at the begin of slot 0.
Result<DirectionWords> begin_table_item(const Head& head, const ChunkReader& read, LoadedItem& item);

// A coded array that is a chunk; faults break `rule`.
Result<CodedRows> read_rows(const ChunkReader& read, const ChunkKey& key, std::uint64_t rows,
                            std::uint64_t columns, Precision precision, const char* rule);

// Appends the params struct, of 4-byte scalars, of each map: make(map, number of its first channel).
template <class Make>
void append_map_params(LoadedItem& item, const Make& make) {
  std::uint32_t first_channel = 0;
  for (const Map& map : item.head.maps) {
    const auto params = make(map, first_channel);
    static_assert(sizeof params % 4 == 0);
    std::vector<std::uint32_t> words(sizeof params / 4);
    std::memcpy(words.data(), &params, sizeof params);
    item.map_params.push_back(std::move(words));
    first_channel += map.channels;
  }
}

}  // namespace btfc
