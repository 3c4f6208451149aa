// Model gm: PARM, chunks, words and sizes.
#include "format/models/gm_payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "format/limits.h"
#include "format/models/gm_field.h"
#include "format/table_model.h"
#include "shaders/models/gm.h"

namespace btfc {
namespace {

constexpr std::uint32_t kGmix = kGmChunkTypes[1], kGscl = kGmChunkTypes[2], kMeanChunk = kGmChunkTypes[3];
constexpr std::uint64_t kParmBytes = 16;

// Rule GM4: ends that keep every gate far from the ends of binary32.
constexpr float kMostPlace = 1048576.0f;               // |mu|, |h|
constexpr float kLeastSpread = -12, kMostSpread = 30;  // log2 sigma
constexpr float kMostHeight = 1024;

constexpr auto kSizeOptions = with_table_options(kGmOptions);

std::uint32_t level_count(const GmParm& p, std::uint32_t level) {
  return gm_level_begin(p.components, p.levels, level + 1) - gm_level_begin(p.components, p.levels, level);
}

std::uint64_t mean_bytes(const Head& head, const GmParm& p) {
  return gm_mean_bits(p.mean, head.views, head.lights, head.pairs, head.channels(), p.mean_rank) / 8;
}

// The mean in words: a table's elements, or steps and then two arrays of codes.
std::uint64_t mean_words(const Head& head, const GmParm& p) {
  const std::uint64_t table = std::uint64_t{head.pairs} * head.channels();
  if (p.mean == GmMeanForm::f32) return table;
  if (p.mean == GmMeanForm::u8) return element_words(table, Precision::u8);
  const std::uint64_t r = p.mean_rank;
  return r + element_words(r * head.views, Precision::u8) +
         element_words(r * head.lights * head.channels(), Precision::u8);
}

std::vector<ChunkSpec> chunks_of(const Head& head, const GmParm& p) {
  std::vector<ChunkSpec> chunks = {directions_chunk(head),
                                   {{kParm, kPayloadChunk}, kParmBytes},
                                   {{kMeanChunk, kPayloadChunk}, mean_bytes(head, p)}};
  const std::uint64_t rows = p.rows(head);
  if (p.precision == Precision::u8) chunks.push_back({{kGscl, kPayloadChunk}, 8 * rows});
  for (std::uint32_t l = 0; l < p.levels; ++l) {
    chunks.push_back({{kGmix, kPayloadChunk, static_cast<std::uint8_t>(l)},
                      4 * element_words(rows * level_count(p, l), p.precision)});
  }
  return chunks;
}

// Columns begin … begin + count - 1 as a chunk, and the scales that go before it.
Bytes level_bytes(const CodedRows& all, std::uint64_t begin, std::uint64_t count) {
  CodedRows part{all.precision, all.rows, count, all.scales, {}};
  for (std::uint64_t r = 0; r < all.rows; ++r) {
    const auto row = all.elements.begin() + static_cast<std::ptrdiff_t>(r * all.columns + begin);
    part.elements.insert(part.elements.end(), row, row + static_cast<std::ptrdiff_t>(count));
  }
  return write_coded_rows(part);
}

Bytes write_mean(const GmMean& mean) {
  Bytes raw;
  const auto push_f32 = [&](float v) {
    raw.resize(raw.size() + 4);
    store_f32(&raw[raw.size() - 4], v);
  };
  if (mean.form == GmMeanForm::f32) {
    for (const float v : mean.table) push_f32(v);
  } else if (mean.form == GmMeanForm::u8) {
    for (const float v : mean.table) raw.push_back(static_cast<std::uint8_t>(std::lround(v * 255.0f)));
  } else {
    for (const float v : mean.steps) push_f32(v);
    for (const std::int8_t code : mean.view_codes) raw.push_back(static_cast<std::uint8_t>(code));
    for (const std::int8_t code : mean.light_codes) raw.push_back(static_cast<std::uint8_t>(code));
  }
  return raw;
}

// Appends the mean's words; rule GM3.
Result<Done> append_mean(const Head& head, const GmParm& p, ByteView raw, std::vector<std::uint32_t>& words) {
  const std::uint64_t numbers = p.mean == GmMeanForm::f32     ? raw.size() / 4
                                : p.mean == GmMeanForm::coded ? p.mean_rank
                                                              : 0;
  for (std::uint64_t i = 0; i < numbers; ++i) {
    const std::uint32_t bits = load_u32(&raw[4 * i]);
    const float v = std::bit_cast<float>(bits);
    if (!(std::fabs(v) <= 4294967296.0f)) {
      return invalid("GM3", 0, fmt::format("MEAN: number {} is not finite or larger than 2^32", i));
    }
    words.push_back(bits);
  }
  if (p.mean == GmMeanForm::f32) return Done{};
  const auto append_codes = [&](ByteView codes, unsigned flip) {
    ElementWriter elements(words, codes.size(), Precision::u8);
    for (std::uint64_t i = 0; i < codes.size(); ++i) elements.set(i, codes[i] ^ flip);
  };
  if (p.mean == GmMeanForm::u8) {
    append_codes(raw, 0);
    return Done{};
  }
  // Signed codes become code + 128.
  const std::uint64_t views = std::uint64_t{p.mean_rank} * head.views;
  append_codes(raw.subspan(4 * numbers, views), 0x80);
  append_codes(raw.subspan(4 * numbers + views), 0x80);
  return Done{};
}

// Rule GM4 for one row.
Result<Done> check_row(const CodedRows& rows, std::uint32_t row, float least, float most, const char* what) {
  for (std::uint64_t m = 0; m < rows.columns; ++m) {
    const float v = rows.value(row, m);
    if (v >= least && v <= most) continue;
    return invalid("GM4", 0,
                   fmt::format("{} of component {} is {:g}, expected {:g} to {:g}", what, m, v, least, most));
  }
  return Done{};
}

Result<Done> check_rows(const Head& head, const GmParm& p, const CodedRows& rows) {
  const std::uint32_t dims = kGmInputs + head.channels();
  const bool paper = p.layout == GmLayout::paper;
  for (std::uint32_t n = 0; n < kGmInputs; ++n) {
    if (const auto ok = check_row(rows, n, -kMostPlace, kMostPlace, "mean"); !ok) return ok.error();
    const auto spread =
        paper ? check_row(rows, dims + n, std::exp2(kLeastSpread), std::exp2(kMostSpread), "spread")
              : check_row(rows, kGmSpreadRow + n, kLeastSpread, kMostSpread, "log2 of spread");
    if (!spread) return spread.error();
  }
  if (paper) {
    for (std::uint32_t n = kGmInputs; n < dims; ++n) {
      if (const auto ok = check_row(rows, dims + n, 0, 4294967296.0f, "spread"); !ok) return ok.error();
    }
    return check_row(rows, 2 * dims, 0, 1, "weight");
  }
  for (std::uint32_t h = p.shape(head).shear_row(); h < rows.rows; ++h) {
    if (const auto ok = check_row(rows, h, -kMostPlace, kMostPlace, "shear"); !ok) return ok.error();
  }
  return check_row(rows, kGmHeightRow, -kMostHeight, kMostHeight, "log2 of the peak");
}

// The levels' columns side by side.
Result<CodedRows> read_levels(const Head& head, const GmParm& p, const ChunkReader& read,
                              std::uint32_t levels) {
  Bytes scales;
  if (p.precision == Precision::u8) {
    Result<Bytes> raw = read({kGscl, kPayloadChunk});
    if (!raw) return raw.error();
    scales = *std::move(raw);
  }
  std::vector<CodedRows> parts;
  CodedRows all{p.precision, p.rows(head), 0, {}, {}};
  for (std::uint32_t l = 0; l < levels; ++l) {
    const Result<Bytes> raw = read({kGmix, kPayloadChunk, static_cast<std::uint8_t>(l)});
    if (!raw) return raw.error();
    Bytes whole = scales;
    whole.insert(whole.end(), raw->begin(), raw->end());
    Result<CodedRows> part = read_coded_rows(whole, all.rows, level_count(p, l), p.precision, "GM3",
                                             fmt::format("GMIX of level {}", l));
    if (!part) return part.error();
    all.columns += part->columns;
    parts.push_back(*std::move(part));
  }
  all.scales = parts[0].scales;
  for (std::uint64_t r = 0; r < all.rows; ++r) {
    for (const CodedRows& part : parts) {
      const auto row = part.elements.begin() + static_cast<std::ptrdiff_t>(r * part.columns);
      all.elements.insert(all.elements.end(), row, row + static_cast<std::ptrdiff_t>(part.columns));
    }
  }
  if (const auto ok = check_rows(head, p, all); !ok) return ok.error();
  return all;
}

// Spec/models/gm.md section 3. Products and sums of four channels are four operations, whatever the map has.
TexelCost gm_cost(const Head& head, const GmParm& p) {
  const auto [channels, views, lights, pair] = cost_terms(head);
  const std::uint64_t m = p.components, rank = p.mean_rank, pairs = views * lights;
  const std::uint64_t best = std::min<std::uint64_t>(m, p.gates == 0 ? m : p.gates);
  // Both unit vectors, four angles and two slopes; the texel's centre; the quotient of the two sums; the
  // mean.
  std::uint64_t operations = 18 + 126 + (p.onion == GmOnion::printed ? 2 : 0) + 2 + 4 + 4, reads = 0;
  if (head.value_transform == ValueTransform::log) operations += 4 * 17;
  if (p.mean == GmMeanForm::coded) {
    operations += rank * (9 + 12 * channels);
    reads += rank * (4 + 3 * channels);
  } else {
    operations += 9 + 3 * pairs * channels;
    reads += pairs * (pair + channels);
  }
  // A gate, with the short way round where textures repeat. What it adds is a power and a product and a sum
  // of outputs and weight. Where the largest gate so far is exceeded the sums are scaled.
  operations += m * (33 + (head.wrap_u == Wrap::repeat ? 10 : 0)) + best * 25;
  operations += 21 * (p.gates == 0 ? std::bit_width(m) : 1);
  reads += m * 15 + best * (channels + (p.gates == 0 ? 0 : 2));
  return {operations, reads};
}

}  // namespace

const std::span<const OptionSpec> kGmSizeOptions = kSizeOptions;

Result<GmParm> gm_parm_from_options(const OptionValues& options, SampleType samples) {
  GmParm p;
  constexpr const char* kLayouts[] = {"compact", "paper"};
  const auto layout = parse_choice(options, "layout", kLayouts);
  if (!layout) return layout.error();
  p.layout = static_cast<GmLayout>(layout->value_or(0));
  const bool paper = p.layout == GmLayout::paper;
  const auto components = parse_u32(options, "components", 1, kGmMaxComponents);
  if (!components) return components.error();
  p.components = components->value_or(p.components);
  const auto gates = parse_u32(options, "gates", 0, UINT32_MAX);
  if (!gates) return gates.error();
  p.gates = gates->value_or(0);
  if (p.gates >= p.components) p.gates = 0;
  if (p.gates > GM_MOST_GATES) {
    return bad_argument(fmt::format("--gates {}: expected 0 to {}, or all {} components", p.gates,
                                    GM_MOST_GATES, p.components));
  }
  const auto precision = parse_precision(options, "precision", paper ? Precision::f32 : Precision::u8);
  if (!precision) return precision.error();
  p.precision = *precision;
  constexpr const char* kMeans[] = {"f32", "u8", "coded"};
  const auto mean = parse_choice(options, "mean-brdf", kMeans);
  if (!mean) return mean.error();
  const GmMeanForm table = samples == SampleType::unorm8 ? GmMeanForm::u8 : GmMeanForm::f32;
  p.mean = *mean ? static_cast<GmMeanForm>(**mean) : paper ? table : GmMeanForm::coded;
  const auto rank = parse_u32(options, "mean-rank", 1, kGmMostMeanRank);
  if (!rank) return rank.error();
  if (*rank && p.mean != GmMeanForm::coded) return bad_argument("--mean-rank: only of --mean-brdf coded");
  p.mean_rank = p.mean == GmMeanForm::coded ? rank->value_or(8) : 0;
  constexpr const char* kSwitch[] = {"on", "off"};
  const auto shear = parse_choice(options, "shear", kSwitch);
  if (!shear) return shear.error();
  p.shear = shear->value_or(paper ? 1 : 0) == 0;
  constexpr const char* kOnions[] = {"signed", "printed"};
  const auto onion = parse_choice(options, "onion", kOnions);
  if (!onion) return onion.error();
  p.onion = static_cast<GmOnion>(onion->value_or(0));
  const auto levels = parse_u32(options, "levels", 1, kGmMostLevels);
  if (!levels) return levels.error();
  p.levels = levels->value_or(paper ? 1 : 4);
  if (!*levels) p.levels = std::min<std::uint32_t>(p.levels, std::bit_width(p.components));
  if (p.components < 1u << (p.levels - 1)) {
    return bad_argument(fmt::format("--levels {}: {} components have at most {} levels", p.levels,
                                    p.components, std::bit_width(p.components)));
  }
  if (paper && (p.precision != Precision::f32 || p.shear || p.levels != 1 || p.mean == GmMeanForm::coded)) {
    return bad_argument(
        "--layout paper has numbers of f32, a table of the mean BRDF, no shear and one level");
  }
  return p;
}

GmParm gm_with_components(GmParm p, std::uint32_t components) {
  p.components = components;
  p.levels = std::min<std::uint32_t>(p.levels, std::bit_width(components));
  if (p.gates >= components) p.gates = 0;
  return p;
}

Bytes write_gm_parm(const GmParm& p) {
  Bytes raw(kParmBytes);
  store_u32(&raw[0], p.components);
  store_u16(&raw[4], static_cast<std::uint16_t>(p.gates));
  raw[6] = static_cast<std::uint8_t>(p.levels);
  raw[7] = static_cast<std::uint8_t>(p.layout);
  raw[8] = static_cast<std::uint8_t>(p.precision);
  raw[9] = static_cast<std::uint8_t>(p.mean);
  raw[10] = p.shear ? 1 : 0;
  // 11: what a component's expert is. 0: a colour. Stored planes that it weights would be another.
  store_u16(&raw[12], static_cast<std::uint16_t>(p.mean_rank));
  raw[14] = static_cast<std::uint8_t>(p.onion);
  return raw;
}

Result<GmParm> read_gm_parm(const Head& head, ByteView raw) {
  if (raw.size() != kParmBytes)
    return invalid("GM1", 0, fmt::format("PARM has {} bytes, expected 16", raw.size()));
  const auto wrong = [](const char* what, std::uint32_t value, const char* expected) {
    return invalid("GM1", 0, fmt::format("PARM has {} {}, expected {}", what, value, expected));
  };
  GmParm p;
  p.components = load_u32(&raw[0]);
  if (p.components < 1 || p.components > kGmMaxComponents)
    return wrong("components", p.components, "1 to 65536");
  p.gates = load_u16(&raw[4]);
  if (p.gates > GM_MOST_GATES) return wrong("gates", p.gates, "0 to 32");
  p.levels = raw[6];
  if (p.levels < 1 || p.levels > kGmMostLevels || p.components < 1u << (p.levels - 1))
    return wrong("levels", p.levels, "1 to 16 and 2^(levels - 1) at most the components");
  if (raw[7] > 1) return wrong("layout", raw[7], "0 or 1");
  p.layout = static_cast<GmLayout>(raw[7]);
  if (raw[8] > 2) return wrong("precision", raw[8], "0 to 2");
  p.precision = static_cast<Precision>(raw[8]);
  if (raw[9] > 2) return wrong("mean_form", raw[9], "0 to 2");
  p.mean = static_cast<GmMeanForm>(raw[9]);
  if (raw[10] > 1) return wrong("shear", raw[10], "0 or 1");
  p.shear = raw[10] == 1;
  if (raw[11] != 0) return wrong("experts", raw[11], "0");
  p.mean_rank = load_u16(&raw[12]);
  const bool coded = p.mean == GmMeanForm::coded;
  if (p.mean_rank > kGmMostMeanRank || coded != (p.mean_rank > 0))
    return wrong("mean_rank", p.mean_rank, "1 to 255 with a coded mean and 0 otherwise");
  if (raw[14] > 1) return wrong("onion", raw[14], "0 or 1");
  p.onion = static_cast<GmOnion>(raw[14]);
  if (raw[15] != 0) return wrong("reserved", raw[15], "0");
  if (p.layout == GmLayout::paper && (p.precision != Precision::f32 || p.shear || p.levels != 1 || coded)) {
    return invalid("GM1", 0,
                   "PARM has layout 1 with a precision, mean_form, shear or levels that it does not have");
  }
  if (const auto counts = check_direction_counts(head); !counts) return counts.error();
  if (head.channels() > kGmMaxChannels)
    return invalid("GM2", 0, fmt::format("HEAD has {} channels, expected at most 4", head.channels()));
  if (head.unbounded || head.wrap_u != head.wrap_v || head.value_transform == ValueTransform::srgb) {
    return invalid("GM2", 0,
                   "HEAD is unbounded, wraps one way only, or has a value transform that is not 0 or 2");
  }
  return p;
}

std::uint64_t gm_formula_bits(const Head& head, const GmParm& p) {
  const std::uint64_t mean =
      gm_mean_bits(p.mean, head.views, head.lights, head.pairs, head.channels(), p.mean_rank);
  if (p.layout == GmLayout::paper) {
    // The 18 M numbers of the paper for three channels, and the M weights.
    return 8 * kParmBytes + mean + std::uint64_t{32} * p.components * (2 * (kGmInputs + head.channels()) + 1);
  }
  return 8 * kParmBytes + mean + gm_mixture_bits(p.shape(head), p.precision, p.levels);
}

std::uint64_t gm_memory_bits(const Head& head, const GmParm& p) {
  return 32 * (direction_words(head) + mean_words(head, p) + std::uint64_t{GM_STRIDE} * p.components);
}

std::vector<RawChunk> gm_write(const Head& head, const GmParm& p, const GmPayload& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_gm_parm(p));
  chunks.push_back({{kMeanChunk, kPayloadChunk}, write_mean(payload.mean)});
  const std::size_t scales = p.precision == Precision::u8 ? 8 * payload.rows.rows : 0;
  for (std::uint32_t l = 0; l < p.levels; ++l) {
    const Bytes raw = level_bytes(payload.rows, gm_level_begin(p.components, p.levels, l), level_count(p, l));
    const auto middle = raw.begin() + static_cast<std::ptrdiff_t>(scales);
    if (l == 0 && scales > 0) chunks.push_back({{kGscl, kPayloadChunk}, Bytes(raw.begin(), middle)});
    chunks.push_back({{kGmix, kPayloadChunk, static_cast<std::uint8_t>(l)}, Bytes(middle, raw.end())});
  }
  return chunks;
}

GmMixture gm_mixture_of_paper(const CodedRows& rows, std::uint32_t channels) {
  const std::uint32_t dims = kGmInputs + channels;
  GmMixture out = gm_make_mixture({static_cast<std::uint32_t>(rows.columns), channels, false});
  for (std::uint32_t m = 0; m < rows.columns; ++m) {
    const double weight = double{rows.value(2 * dims, m)};
    double height = std::log2(weight);
    for (std::uint32_t n = 0; n < kGmInputs; ++n) {
      const double spread = std::log2(double{rows.value(dims + n, m)});
      out.row(kGmMeanRow + n)[m] = rows.value(n, m);
      out.row(kGmSpreadRow + n)[m] = static_cast<float>(spread);
      height -= spread;
    }
    out.row(kGmHeightRow)[m] = weight > 0 ? static_cast<float>(height) : GM_NEVER;
    for (std::uint32_t c = 0; c < channels; ++c) out.row(kGmOutputRow + c)[m] = rows.value(kGmInputs + c, m);
  }
  return out;
}

Result<ItemDescription> gm_describe(const OptionValues& options) {
  const auto shape_for = [&](const Head& head) { return gm_parm_from_options(options, head.maps[0].type); };
  return describe_table(ModelId::gm, options, shape_for, write_gm_parm, read_gm_parm);
}

Result<Layout> gm_layout(const Head& head, ByteView raw) {
  const Result<GmParm> p = read_gm_parm(head, raw);
  if (!p) return p.error();
  Layout layout;
  layout.chunks = chunks_of(head, *p);
  layout.formula_bits = gm_formula_bits(head, *p);
  layout.memory_bits = gm_memory_bits(head, *p);
  const bool mean_f32 = p->mean == GmMeanForm::f32;
  const std::uint32_t channels = head.channels();
  const std::uint64_t bits = gm_paper_bits(p->components, head.pairs, channels, mean_f32);
  const std::uint64_t tile = std::uint64_t{channels} * head.texels() * head.pairs;
  const double raw_bits = static_cast<double>(tile) * (mean_f32 ? 32 : 8);
  layout.paper = PaperCount{
      "Filip, Grim, Haindl: means and spreads of 32 bits and the mean BRDF as a table, without weights",
      bits,
      {{"values", std::to_string(std::uint64_t{2} * (kGmInputs + channels) * p->components +
                                 std::uint64_t{head.pairs} * channels)},
       {"tile_values", std::to_string(tile)},
       {"bits_with_weights", std::to_string(bits + std::uint64_t{32} * p->components)},
       {"ratio", fmt::format("{:.6g}", raw_bits / static_cast<double>(bits))}}};
  layout.parameters = {{"components", std::to_string(p->components)},
                       {"gates", std::to_string(p->gates)},
                       {"levels", std::to_string(p->levels)},
                       {"layout", p->layout == GmLayout::paper ? "paper" : "compact", false},
                       {"precision", name_of(p->precision), false},
                       {"mean_brdf",
                        p->mean == GmMeanForm::coded ? "coded"
                        : mean_f32                   ? "f32"
                                                     : "u8",
                        false},
                       {"mean_rank", std::to_string(p->mean_rank)},
                       {"shear", p->shear ? "on" : "off", false},
                       {"onion", p->onion == GmOnion::printed ? "printed" : "signed", false}};
  for (const Map& map : head.maps) {
    const std::uint64_t outputs = std::uint64_t{8} * element_bytes(p->precision) * p->components;
    layout.map_bits.push_back(map.channels * outputs);
  }
  layout.cost = gm_cost(head, *p);
  return layout;
}

Result<Bytes> gm_reduced(const Head& head, ByteView raw, const Knobs& knobs) {
  Result<GmParm> p = read_gm_parm(head, raw);
  if (!p) return p.error();
  if (knobs.levels != 0 && knobs.levels < p->levels) {
    const std::uint32_t components = gm_level_begin(p->components, p->levels, knobs.levels);
    p->levels = knobs.levels;
    p = gm_with_components(*p, components);
  }
  if (knobs.gates != 0 && knobs.gates < p->components) p->gates = knobs.gates;
  return write_gm_parm(*p);
}

Result<LoadedItem> gm_load(const Head& head, ByteView raw, const ChunkReader& read, std::uint32_t levels) {
  const Result<GmParm> parm = read_gm_parm(head, raw);
  if (!parm) return parm.error();
  const GmParm& p = *parm;
  LoadedItem item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();
  const auto mean_word = static_cast<std::uint32_t>(item.words[0].size());
  const Result<Bytes> mean = read({kMeanChunk, kPayloadChunk});
  if (!mean) return mean.error();
  if (const auto ok = append_mean(head, p, *mean, item.words[0]); !ok) return ok.error();
  const Result<CodedRows> rows = read_levels(head, p, read, std::min(levels, p.levels - 1) + 1);
  if (!rows) return rows.error();
  GmShape shape = p.shape(head);
  shape.components = static_cast<std::uint32_t>(rows->columns);
  GmMixture mixture;
  if (p.layout == GmLayout::paper) {
    mixture = gm_mixture_of_paper(*rows, head.channels());
    const auto heights = mixture.row(kGmHeightRow);
    if (std::all_of(heights.begin(), heights.end(), [](float h) { return h == GM_NEVER; }))
      return invalid("GM4", 0, "all weights are 0");
  } else {
    mixture = gm_dequantise({shape, *rows});
  }
  item.words[GM_COMPONENTS] =
      gm_component_words(gm_field(mixture, head.width, head.height, head.wrap_u == Wrap::repeat));
  append_map_params(item, [&](const Map& map, std::uint32_t first_channel) {
    return GmParams{head.width,
                    head.height,
                    static_cast<uint>(head.wrap_u),
                    static_cast<uint>(head.wrap_v),
                    map.channels,
                    first_channel,
                    head.channels(),
                    shape.components,
                    p.gates,
                    at->views,
                    at->lights,
                    at->pairs,
                    head.views,
                    head.lights,
                    static_cast<uint>(p.mean),
                    mean_word,
                    p.mean_rank,
                    static_cast<uint>(head.value_transform),
                    static_cast<uint>(p.onion)};
  });
  return item;
}

}  // namespace btfc
