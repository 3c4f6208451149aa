// Chunks and words of the random-field models.
#include "format/models/field_payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "format/limits.h"
#include "format/models/field_options.h"
#include "format/models/field_response.h"
#include "format/models/field_torus.h"
#include "format/table_model.h"

namespace btfc {
namespace {

constexpr auto kSizeOptions = with_table_options(kFieldOptions);
constexpr float kMostHeight = 65536, kMostRelief = 1;

Bytes write_index(const FieldShape& s, const std::vector<std::uint16_t>& index) {
  std::vector<std::uint32_t> words(ceil_div(index.size() * s.index_bits(), 32));
  for (std::size_t i = 0; i < index.size(); ++i) {
    const std::uint64_t bit = i * s.index_bits(), value = std::uint64_t{index[i]} << (bit & 31);
    words[bit >> 5] |= static_cast<std::uint32_t>(value);
    if (value >> 32 != 0) words[(bit >> 5) + 1] |= static_cast<std::uint32_t>(value >> 32);
  }
  return from_words(words);
}

Bytes write_range(const FieldShape& s, const FieldPayload& payload) {
  Bytes raw(8);
  store_f32(&raw[0], payload.relief);
  store_f32(&raw[4], payload.height_step);
  for (const std::uint16_t code : payload.range) {
    raw.push_back(static_cast<std::uint8_t>(code));
    if (s.range_bits == 16) raw.push_back(static_cast<std::uint8_t>(code >> 8));
  }
  raw.resize(8 + 4 * ceil_div(raw.size() - 8, 4));
  return raw;
}

// Rule FD3.
Result<Done> append_index(const Head& head, const FieldShape& s, ByteView raw,
                          std::vector<std::uint32_t>& words) {
  const std::vector<std::uint32_t> index = to_words(raw);
  std::vector<bool> used(s.clusters);
  std::uint32_t rest = 0;
  for (std::uint64_t bit = 0; bit < 32 * index.size(); bit += s.index_bits()) {
    std::uint64_t value = index[bit >> 5] >> (bit & 31);
    if ((bit >> 5) + 1 < index.size()) value |= std::uint64_t{index[(bit >> 5) + 1]} << (32 - (bit & 31));
    const std::uint64_t pair = bit / s.index_bits();
    if (pair >= head.pairs) {
      rest |= static_cast<std::uint32_t>(value);
      continue;
    }
    value &= (std::uint64_t{1} << s.index_bits()) - 1;
    if (value >= s.clusters) {
      return invalid("FD3", 0,
                     fmt::format("pair {} has subspace {}, expected below {}", pair, value, s.clusters));
    }
    used[value] = true;
  }
  if (rest != 0) return invalid("FD3", 0, "the padding of SIDX is not 0");
  const auto unused = std::find(used.begin(), used.end(), false);
  if (unused != used.end())
    return invalid("FD3", 0, fmt::format("no pair has subspace {}", unused - used.begin()));
  words.insert(words.end(), index.begin(), index.end());
  return Done{};
}

void push(std::vector<std::uint32_t>& words, float value) {
  words.push_back(std::bit_cast<std::uint32_t>(value));
}

// Rule FD4.
Result<Done> append_range(const FieldShape& s, ByteView raw, std::vector<std::uint32_t>& words) {
  const float relief = load_f32(&raw[0]), step = load_f32(&raw[4]);
  if (!(relief >= 0 && relief <= kMostRelief))
    return invalid("FD4", 0, fmt::format("RMAP has a strength of {:g}, expected 0 to 1", relief));
  if (!(step >= 0 && step <= kMostHeight))
    return invalid("FD4", 0, fmt::format("RMAP has a step of {:g} texels, expected 0 to 65536", step));
  push(words, relief);
  const std::size_t bytes = s.range_bits / 8, count = std::size_t{s.range_width} * s.range_height;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* at = &raw[8 + i * bytes];
    push(words, step * static_cast<float>(bytes == 1 ? std::uint32_t{*at} : load_u16(at)));
  }
  if (std::any_of(raw.begin() + static_cast<std::ptrdiff_t>(8 + count * bytes), raw.end(),
                  [](std::uint8_t b) { return b != 0; }))
    return invalid("FD4", 0, "the padding of RMAP is not 0");
  return Done{};
}

// Rule FD5 beside what all coded arrays keep: spreads, scales and rests are not below 0.
Result<Done> check_not_negative(const CodedRows& rows, std::uint64_t column, const char* what) {
  for (std::uint64_t k = 0; k < rows.rows; ++k) {
    if (rows.value(k, column) < 0)
      return invalid(
          "FD5", 0,
          fmt::format("{} of subspace {} is {:g}, expected 0 or more", what, k, rows.value(k, column)));
  }
  return Done{};
}

void append_rows(const CodedRows& rows, std::vector<std::uint32_t>& words) {
  for (std::uint64_t r = 0; r < rows.rows; ++r) {
    for (std::uint64_t c = 0; c < rows.columns; ++c) push(words, rows.value(r, c));
  }
}

// The words of a level's record begin at `record`; its neighbourhoods and numbers are appended.
Result<Done> append_level(const FieldShape& s, std::uint32_t level, const ChunkReader& read, bool loaded,
                          std::uint32_t record, LoadedItem& item) {
  std::vector<std::uint32_t>& words = item.words[0];
  words[record] = s.kind == FieldKind::gmrf ? s.torus_side(level) : s.margins[level];
  words[record + 1] = static_cast<std::uint32_t>(item.words[1].size());
  words[record + 2] = static_cast<std::uint32_t>(s.response_words(level));
  words[record + 3] = static_cast<std::uint32_t>(words.size());
  if (!loaded) return Done{};
  for (std::uint32_t f = 0; f < s.masks_per_level(); ++f) {
    words.push_back(static_cast<std::uint32_t>(s.mask(level, f)));
    words.push_back(static_cast<std::uint32_t>(s.mask(level, f) >> 32));
  }
  const Result<CodedRows> rows = read_rows(read, {kFlds, kPayloadChunk, field_chunk_level(s, level)},
                                           s.clusters, s.level_numbers(level), s.precision, "FD5");
  if (!rows) return rows.error();
  for (std::uint32_t f = 0; f < s.factors && !s.coupled(); ++f) {
    if (const auto ok = check_not_negative(*rows, s.factor_begin(level, f), "the spread"); !ok)
      return ok.error();
  }
  const std::size_t first = words.size();
  append_rows(*rows, words);
  std::vector<float> numbers(words.size() - first);
  std::memcpy(numbers.data(), &words[first], numbers.size() * sizeof(float));
  const FieldBand band = field_band(s, level, numbers.data());
  const std::uint64_t stride = s.response_words(level);
  std::vector<float> responses(s.responses() / s.clusters * stride);
  for (std::uint32_t k = 0; k < s.clusters; ++k) {
    if (s.kind == FieldKind::gmrf) {
      for (std::uint32_t f = 0; f < s.factors; ++f) {
        const auto ok = field_torus(band, k, f, s.torus_side(level), responses.data() + f * stride);
        if (!ok) return ok.error();
      }
    } else if (const auto ok = field_responses(band, k, responses.data()); !ok) {
      return ok.error();
    }
    for (const float v : responses) push(item.words[1], v);
  }
  return Done{};
}

// Rules of a subspace's record.
Result<Done> check_records(const FieldShape& s, const CodedRows& rows) {
  const std::uint32_t first = s.record_numbers() - s.factors * (s.levels + s.knots);
  if (const auto ok = check_not_negative(rows, first - 1, "the signature's rest"); !ok) return ok.error();
  for (std::uint32_t f = 0; f < s.factors; ++f) {
    for (std::uint32_t i = 0; i < s.levels; ++i) {
      const auto ok =
          check_not_negative(rows, first + f * (s.levels + s.knots) + i, i == 0 ? "the scale" : "the rest");
      if (!ok) return ok.error();
    }
  }
  return Done{};
}

// The pyramid's value of one factor of one subspace, level by level, for a texel that takes part in as many
// texels of coarser levels as any does.
TexelCost direct_value_cost(const FieldShape& s) {
  constexpr std::uint64_t kPlaces[] = {1, 9, 16};
  TexelCost value{0, 0};
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    const std::uint64_t places = kPlaces[std::min(l, 2u)];
    const std::uint64_t noises =
        s.kind == FieldKind::gmrf ? 0 : s.response_words(l) * (s.coupled() ? s.factors : 1);
    value.operations += 16 + (l > 0 ? 40 : 0) + places * (2 + 3 * noises);
    value.reads += places * (3 + (s.kind == FieldKind::gmrf ? 1 : noises));
  }
  return value;
}

// The same from the atlas: the products of weights, of which one is not zero, and a texel.
constexpr TexelCost kPreparedValueCost{16 + 2, 1};

// Of a texel, given what one factor's value takes (spec/models/car.md section 6).
TexelCost field_cost(const Head& head, const FieldShape& s, const TexelCost& value) {
  const auto [channels, views, lights, pair] = cost_terms(head);
  const std::uint64_t products = std::min<std::uint64_t>(4, views * lights);
  const std::uint64_t subspaces = std::min<std::uint64_t>(products, s.clusters);
  const std::uint64_t factors = s.coupled() ? channels : s.factors;
  // A factor: its value, its table, the basis.
  TexelCost factor{value.operations + (s.coupled() ? 1 : 2 * channels),
                   value.reads + (s.coupled() ? 0 : channels)};
  if (s.knots > 0) {
    factor.operations += 8;
    factor.reads += 3;
  }
  // Then the blend: the closest pairs, their subspaces, the gain, means and deviations; and the relief.
  const std::uint64_t entry_words = s.clusters == 1 ? 0 : 32 % s.index_bits() == 0 ? 1 : 2;
  const bool relief = s.range_bits > 0;
  return {subspaces * (factors * factor.operations + 16 + 19) + 25 + products + 8 + 12 + (relief ? 117 : 0),
          subspaces * (factors * factor.reads + channels + 4) + products * (pair + entry_words) +
              (relief ? 17 : 0)};
}

}  // namespace

const std::span<const OptionSpec> kFieldSizeOptions = kSizeOptions;

std::vector<RawChunk> field_write(const Head& head, const FieldShape& s, const FieldPayload& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_field_parm(s));
  if (s.index_bits() > 0)
    chunks.push_back({{kSidx, kPayloadChunk}, write_index(s, payload.subspace_of_pair)});
  if (s.range_bits > 0) chunks.push_back({{kRmap, kPayloadChunk}, write_range(s, payload)});
  const auto rows = [&](const std::vector<float>& numbers, std::uint32_t columns) {
    return write_coded_rows(code_rows(numbers, s.clusters, columns, s.precision));
  };
  chunks.push_back({{kSubs, kPayloadChunk}, rows(payload.records, s.record_numbers())});
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    chunks.push_back(
        {{kFlds, kPayloadChunk, field_chunk_level(s, l)}, rows(payload.levels[l], s.level_numbers(l))});
  }
  return chunks;
}

template <ModelId kModel>
Result<ItemDescription> field_describe(const OptionValues& options) {
  Result<Head> head = table_head(kModel, options);
  if (!head) return head.error();
  head->unbounded = true;
  const Result<FieldShape> shape = field_shape_from_options(options, *head, 10, 12);
  if (!shape) return shape.error();
  const Bytes parm = write_field_parm(*shape);
  if (const auto checked = read_field_parm(*head, parm); !checked) return as_usage(checked.error());
  return ItemDescription{*head, parm};
}
template Result<ItemDescription> field_describe<ModelId::car>(const OptionValues&);
template Result<ItemDescription> field_describe<ModelId::gmrf>(const OptionValues&);
template Result<ItemDescription> field_describe<ModelId::car3d>(const OptionValues&);

Result<Layout> field_layout(const Head& head, ByteView raw) {
  const Result<FieldShape> parsed = read_field_parm(head, raw);
  if (!parsed) return parsed.error();
  const FieldShape& s = *parsed;
  Layout layout;
  layout.chunks = field_chunks(head, s);
  layout.formula_bits = field_formula_bits(head, s);
  layout.memory_bits = 32 * field_memory_words(head, s);
  std::string orders, margins;
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    for (std::uint32_t f = 0; f < s.masks_per_level(); ++f)
      orders += fmt::format("{}{}", f > 0 ? "/" : l > 0 ? "," : "", s.neighbours(l, f));
    margins +=
        fmt::format("{}{}", l > 0 ? "," : "", s.kind == FieldKind::gmrf ? s.torus_side(l) : s.margins[l]);
  }
  layout.parameters = {{"clusters", std::to_string(s.clusters)},
                       {"levels", std::to_string(s.levels)},
                       {"orders", orders, false},
                       {s.kind == FieldKind::gmrf ? "tori" : "margins", margins, false},
                       {"knots", std::to_string(s.knots)},
                       {"range", fmt::format("{}x{}", s.range_width, s.range_height), false},
                       {"range_bits", std::to_string(s.range_bits)},
                       {"precision", name_of(s.precision), false},
                       {"seed", std::to_string(s.seed)},
                       {"error", fmt::format("{:.6g}", s.error)}};
  layout.cost = field_cost(head, s, direct_value_cost(s));
  layout.prepared_cost = field_cost(head, s, kPreparedValueCost);
  // Means and rows of bases.
  for (const Map& map : head.maps) {
    layout.map_bits.push_back(8 * element_bytes(s.precision) * s.clusters * map.channels *
                              (1 + (s.coupled() ? 0 : s.factors)));
  }
  return layout;
}

FieldBand field_band_of_words(const LoadedItem& item, const FieldParams& p, std::uint32_t level) {
  const std::vector<std::uint32_t>& words = item.words[0];
  const std::uint32_t record = p.level_word + FIELD_LEVEL_WORDS * level;
  FieldShape s;
  s.kind = static_cast<FieldKind>(p.kind);
  s.factors = p.all_channels;
  s.clusters = p.clusters;
  s.levels = level + 1;
  s.seed = p.seed;
  s.margins[level] = words[record];
  s.masks.resize(std::size_t{s.levels} * s.masks_per_level());
  std::uint32_t at = words[record + 3];
  for (std::uint32_t f = 0; f < s.masks_per_level(); ++f, at += 2)
    s.masks[std::size_t{level} * s.masks_per_level() + f] = words[at] | std::uint64_t{words[at + 1]} << 32;
  static_assert(sizeof(float) == sizeof(std::uint32_t));
  static_assert(FIELD_CAR == static_cast<uint>(FieldKind::car) &&
                FIELD_GMRF == static_cast<uint>(FieldKind::gmrf) &&
                FIELD_CAR3D == static_cast<uint>(FieldKind::car3d));
  FieldBand band = field_band(s, level, reinterpret_cast<const float*>(words.data() + at));
  band.period = p.period;
  return band;
}

Result<LoadedItem> field_load(const Head& head, ByteView raw, const ChunkReader& read, std::uint32_t levels) {
  const Result<FieldShape> parsed = read_field_parm(head, raw);
  if (!parsed) return parsed.error();
  const FieldShape& s = *parsed;
  LoadedItem item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();
  std::vector<std::uint32_t>& words = item.words[0];
  const auto here = [&] { return static_cast<std::uint32_t>(words.size()); };
  const std::uint32_t index_word = here();
  if (s.index_bits() > 0) {
    const Result<Bytes> index = read({kSidx, kPayloadChunk});
    if (!index) return index.error();
    if (const auto ok = append_index(head, s, *index, words); !ok) return ok.error();
  }
  const std::uint32_t range_word = here();
  if (s.range_bits > 0) {
    const Result<Bytes> range = read({kRmap, kPayloadChunk});
    if (!range) return range.error();
    if (const auto ok = append_range(s, *range, words); !ok) return ok.error();
  }
  const std::uint32_t subspace_word = here();
  const Result<CodedRows> records =
      read_rows(read, {kSubs, kPayloadChunk}, s.clusters, s.record_numbers(), s.precision, "FD5");
  if (!records) return records.error();
  if (const auto ok = check_records(s, *records); !ok) return ok.error();
  append_rows(*records, words);
  const std::uint32_t level_word = here();
  words.resize(words.size() + std::size_t{FIELD_LEVEL_WORDS} * s.levels);
  const std::uint32_t least = s.levels - 1 - std::min(levels, s.levels - 1);
  for (std::uint32_t l = s.levels; l-- > 0;) {
    const auto ok = append_level(s, l, read, l >= least, level_word + FIELD_LEVEL_WORDS * l, item);
    if (!ok) return ok.error();
  }
  append_map_params(item, [&](const Map& map, std::uint32_t first_channel) {
    return FieldParams{head.width,
                       head.height,
                       map.channels,
                       first_channel,
                       s.factors,
                       s.clusters,
                       s.levels,
                       static_cast<uint>(s.kind),
                       at->views,
                       at->lights,
                       at->pairs,
                       head.lights,
                       index_word,
                       s.index_bits(),
                       subspace_word,
                       s.knots,
                       range_word,
                       s.range_width | s.range_height << 16,
                       level_word,
                       s.seed,
                       0,
                       0,
                       least,
                       0,
                       0,
                       0,
                       0};
  });
  return item;
}

}  // namespace btfc
