// Chunks, words and sizes of model plm.
#include "format/models/plm_payload.h"

#include <fmt/format.h>

#include "format/limits.h"
#include "format/row_table.h"
#include "format/table_model.h"
#include "shaders/models/plm.h"

namespace btfc {
namespace {

constexpr std::uint32_t kIndx = four_cc("INDX"), kLobe = four_cc("LOBE"), kPoly = four_cc("POLY");
constexpr std::uint32_t kChunkTypes[] = {kDirs, kIndx, kLobe, kPoly};
constexpr std::uint64_t kParmBytes = 8;
constexpr ChunkKey kPolyKey = {kPoly, kPayloadChunk, 1};
static_assert(kPlmTerms == BTFC_PLM_TERMS);

constexpr OptionSpec kOwnOptions[] = {
    {"precision", "f32|f16|u8", "of the lobes (default f32)"},
    {"table-precision", "f32|f16|u8", "of the polynomials (default f32)"},
    {"polynomial", "none|histogram|least-squares", "none: eq. 3 alone; the others have the same size"},
    {"clusters", "C", "lobes of a view and channel, 1 to 256 (default 0: one a texel)"},
};
constexpr auto kSizeOptions = with_table_options(kOwnOptions);

// Of one view, for so many channels.
CheckedSize lobe_bytes(const Head& head, std::uint32_t channels, const PlmShape& s) {
  return coded_rows_bytes(std::uint64_t{kPlmParameters} * channels,
                          s.clusters > 0 ? s.clusters : head.texels(), s.lobes);
}
CheckedSize index_bytes(const Head& head, std::uint32_t channels, const PlmShape& s) {
  if (s.clusters == 0) return CheckedSize(0);
  return align_up(CheckedSize(channels) * CheckedSize(head.texels()), 2);
}
CheckedSize term_bytes(const Head& head, std::uint32_t channels, const PlmShape& s) {
  if (!s.polynomials) return CheckedSize(0);
  return coded_rows_bytes(std::uint64_t{kPlmTerms} * channels, head.pairs, s.terms);
}

RowTable texel_rows(const Head& head, const PlmShape& s) {
  const std::uint64_t rows = head.views * head.texels();
  if (s.clusters > 0) return {rows, head.channels(), Precision::u8, 1, 3};
  return {rows, std::uint64_t{kPlmParameters} * head.channels(), s.lobes, 1, 3};
}

std::uint64_t book_elements(const Head& head, const PlmShape& s) {
  return std::uint64_t{head.views} * s.clusters * kPlmParameters * head.channels();
}
std::uint64_t term_elements(const Head& head, const PlmShape& s) {
  return s.polynomials ? std::uint64_t{head.pairs} * kPlmTerms * head.channels() : 0;
}

// Words of slot 0.
std::uint64_t table_words(const Head& head, const PlmShape& s) {
  const std::uint64_t lobe_scales = std::uint64_t{head.views} * kPlmParameters * head.channels();
  const std::uint64_t term_scales = s.polynomials ? std::uint64_t{kPlmTerms} * head.channels() : 0;
  return direction_words(head) + 2 * (lobe_scales + term_scales) +
         element_words(term_elements(head, s), s.terms) + element_words(book_elements(head, s), s.lobes);
}

ChunkKey view_key(std::uint32_t type, std::uint32_t view) { return {type, kPayloadChunk, 0, 0, view}; }

Result<std::vector<std::uint8_t>> read_entries(const Head& head, const PlmShape& s, const ChunkReader& read,
                                               std::uint32_t view) {
  Result<Bytes> raw = read(view_key(kIndx, view));
  if (!raw) return raw.error();
  const std::uint64_t count = head.channels() * head.texels();
  for (std::uint64_t i = 0; i < raw->size(); ++i) {
    if (i >= count && (*raw)[i] != 0)
      return invalid("PL4", 0, fmt::format("the padding of INDX of view {} is not 0", view));
    if (i < count && (*raw)[i] >= s.clusters) {
      return invalid("PL4", 0,
                     fmt::format("texel {} of INDX of view {} names lobe {}, expected one below {}",
                                 i % head.texels(), view, (*raw)[i], s.clusters));
    }
  }
  return std::vector<std::uint8_t>(raw->begin(), raw->begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

const std::span<const std::uint32_t> kPlmChunkTypes = kChunkTypes;
const std::span<const OptionSpec> kPlmSizeOptions = kSizeOptions;

Result<PlmShape> plm_shape_from_options(const OptionValues& options) {
  const auto lobes = parse_precision(options, "precision", Precision::f32);
  if (!lobes) return lobes.error();
  const auto terms = parse_precision(options, "table-precision", Precision::f32);
  if (!terms) return terms.error();
  const auto polynomial = parse_choice(options, "polynomial", kPlmPolynomialNames);
  if (!polynomial) return polynomial.error();
  const auto clusters = parse_u32(options, "clusters", 0, kPlmMostClusters);
  if (!clusters) return clusters.error();
  return PlmShape{*lobes, *terms, *polynomial != 0u, clusters->value_or(0)};
}

Bytes write_plm_parm(const PlmShape& s) {
  Bytes parm(kParmBytes);
  parm[0] = static_cast<std::uint8_t>(s.lobes);
  parm[1] = static_cast<std::uint8_t>(s.terms);
  parm[2] = s.polynomials ? 1 : 0;
  store_u32(&parm[4], s.clusters);
  return parm;
}

Result<PlmShape> read_plm_parm(const Head& head, ByteView parm) {
  if (parm.size() != kParmBytes || parm[0] > 2 || parm[1] > 2 || parm[2] > 1 || parm[3] != 0)
    return invalid("PL1", 0,
                   "PARM is not 8 bytes with precisions 0 to 2, polynomials 0 or 1 and its reserved byte 0");
  const PlmShape s{static_cast<Precision>(parm[0]), static_cast<Precision>(parm[1]), parm[2] == 1,
                   load_u32(&parm[4])};
  if (s.clusters > kPlmMostClusters) {
    return invalid("PL1", 0,
                   fmt::format("PARM has {} clusters, expected at most {}", s.clusters, kPlmMostClusters));
  }
  if (const auto checked = check_table_head(head); !checked) return checked.error();
  const std::uint32_t channels = head.channels();
  if (lobe_bytes(head, channels, s).saturated() > kMaxChunkBytes ||
      index_bytes(head, channels, s).saturated() > kMaxChunkBytes ||
      term_bytes(head, channels, s).saturated() > kMaxChunkBytes ||
      4 * table_words(head, s) > kMaxChunkBytes || !texel_rows(head, s).fits()) {
    return invalid(
        "PL2", 0,
        fmt::format("{}x{} texels of {} channels under {} views and {} pairs need chunks or tables "
                    "above 2^27 bytes or more than three word slots of 2^27 bytes",
                    head.width, head.height, channels, head.views, head.pairs));
  }
  return s;
}

std::uint64_t plm_formula_bits(const Head& head, const PlmShape& s) {
  const std::uint32_t channels = head.channels();
  return 8 * (kParmBytes +
              head.views * (lobe_bytes(head, channels, s).value() + index_bytes(head, channels, s).value()) +
              term_bytes(head, channels, s).value());
}

std::uint64_t plm_memory_bits(const Head& head, const PlmShape& s) {
  return 32 * (table_words(head, s) + texel_rows(head, s).words());
}

std::uint64_t plm_paper_values(const Head& head) {
  return 5 * head.channels() * (head.texels() * head.views + head.pairs);
}

std::vector<RawChunk> plm_write(const Head& head, const PlmShape& s, const PlmPayload& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_plm_parm(s));
  for (std::uint32_t view = 0; view < head.views; ++view) {
    chunks.push_back({view_key(kLobe, view), write_coded_rows(payload.lobes[view])});
    if (s.clusters == 0) continue;
    Bytes entries = payload.entries[view];
    entries.resize(index_bytes(head, head.channels(), s).value());
    chunks.push_back({view_key(kIndx, view), std::move(entries)});
  }
  if (s.polynomials) chunks.push_back({kPolyKey, write_coded_rows(payload.terms)});
  return chunks;
}

Result<ItemDescription> plm_describe(const OptionValues& options) {
  const auto shape_for = [&](const Head&) { return plm_shape_from_options(options); };
  return describe_table(ModelId::plm, options, shape_for, write_plm_parm, read_plm_parm);
}

Result<Layout> plm_layout(const Head& head, ByteView parm) {
  const Result<PlmShape> shape = read_plm_parm(head, parm);
  if (!shape) return shape.error();
  const PlmShape& s = *shape;
  const std::uint32_t channels = head.channels();
  Layout layout;
  layout.chunks = {directions_chunk(head), {{kParm, kPayloadChunk}, kParmBytes}};
  for (std::uint32_t view = 0; view < head.views; ++view) {
    layout.chunks.push_back({view_key(kLobe, view), lobe_bytes(head, channels, s).value()});
    if (s.clusters > 0)
      layout.chunks.push_back({view_key(kIndx, view), index_bytes(head, channels, s).value()});
  }
  if (s.polynomials) layout.chunks.push_back({kPolyKey, term_bytes(head, channels, s).value()});
  layout.formula_bits = plm_formula_bits(head, s);
  layout.memory_bits = plm_memory_bits(head, s);
  // The survey's count is that of lobes a texel with polynomials, whatever this file has.
  layout.paper = survey_count(head, plm_paper_values(head));
  // The light's unit vector. A lobe, one a view and channel: five scales; a scalar product of 5, a logarithm
  // of 27, a power of 15, n and rho; Horner's 9; the view's share. A coefficient of a polynomial: for each
  // light its scale, a product and a sum.
  const CostTerms cost = cost_terms(head);
  const std::uint64_t lobes = cost.views * cost.channels, terms = s.polynomials ? 5 * lobes : 0;
  layout.cost =
      TexelCost{9 + lobes * (10 + 49 + 9 + 2) + 4 * terms * cost.lights,
                lobes * (15 + (s.clusters > 0 ? 1 : 0)) + terms * (2 + cost.lights * (1 + cost.pair))};
  layout.parameters = {{"lobe_precision", name_of(s.lobes), false},
                       {"table_precision", name_of(s.terms), false},
                       {"polynomials", s.polynomials ? "1" : "0"},
                       {"clusters", std::to_string(s.clusters)}};
  for (const Map& map : head.maps) {
    layout.map_bits.push_back(8 * (head.views * (lobe_bytes(head, map.channels, s).value() +
                                                 index_bytes(head, map.channels, s).value()) +
                                   term_bytes(head, map.channels, s).value()));
  }
  return layout;
}

Result<Bytes> plm_reduced(const Head& head, ByteView parm, const Knobs& knobs) {
  Result<PlmShape> shape = read_plm_parm(head, parm);
  if (!shape) return shape.error();
  shape->polynomials = shape->polynomials && knobs.levels != 1;
  return write_plm_parm(*shape);
}

Result<LoadedItem> plm_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels) {
  const Result<PlmShape> shape = read_plm_parm(head, parm);
  if (!shape) return shape.error();
  PlmShape s = *shape;
  s.polynomials = s.polynomials && levels > 0;
  LoadedItem item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();

  const std::uint64_t texels = head.texels(), channels = head.channels();
  const std::uint64_t lobe_rows = kPlmParameters * channels, term_rows = kPlmTerms * channels;
  const RowTable table = texel_rows(head, s);
  RowTableWriter rows(table, item);
  std::vector<RowScale> lobe_scales;
  std::vector<std::uint32_t> book;  // elements, view by view, entry by entry
  for (std::uint32_t view = 0; view < head.views; ++view) {
    const std::uint64_t columns = s.clusters > 0 ? s.clusters : texels;
    const Result<CodedRows> lobes =
        read_rows(read, view_key(kLobe, view), lobe_rows, columns, s.lobes, "PL3");
    if (!lobes) return lobes.error();
    lobe_scales.insert(lobe_scales.end(), lobes->scales.begin(), lobes->scales.end());
    if (s.clusters == 0) {
      for (std::uint64_t r = 0; r < lobe_rows; ++r) {
        for (std::uint64_t t = 0; t < texels; ++t)
          rows.set(view * texels + t, r, lobes->elements[r * texels + t]);
      }
      continue;
    }
    for (std::uint64_t entry = 0; entry < columns; ++entry) {
      for (std::uint64_t r = 0; r < lobe_rows; ++r) book.push_back(lobes->elements[r * columns + entry]);
    }
    const Result<std::vector<std::uint8_t>> entries = read_entries(head, s, read, view);
    if (!entries) return entries.error();
    for (std::uint64_t c = 0; c < channels; ++c) {
      for (std::uint64_t t = 0; t < texels; ++t) rows.set(view * texels + t, c, (*entries)[c * texels + t]);
    }
  }

  const auto lobe_scale_word = static_cast<std::uint32_t>(item.words[0].size());
  append_scales(lobe_scales, item.words[0]);
  const auto term_scale_word = static_cast<std::uint32_t>(item.words[0].size());
  std::uint32_t term_word = term_scale_word;
  if (s.polynomials) {
    const Result<CodedRows> terms = read_rows(read, kPolyKey, term_rows, head.pairs, s.terms, "PL3");
    if (!terms) return terms.error();
    append_scales(terms->scales, item.words[0]);
    ElementWriter writer(item.words[0], term_elements(head, s), s.terms);
    term_word = writer.first_word();
    for (std::uint64_t r = 0; r < term_rows; ++r) {
      for (std::uint64_t pair = 0; pair < head.pairs; ++pair)
        writer.set(pair * term_rows + r, terms->elements[r * head.pairs + pair]);
    }
  }
  ElementWriter writer(item.words[0], book.size(), s.lobes);
  for (std::uint64_t i = 0; i < book.size(); ++i) writer.set(i, book[i]);

  append_map_params(item, [&](const Map& map, std::uint32_t first_channel) {
    return PlmParams{head.width,
                     head.height,
                     static_cast<uint>(head.wrap_u),
                     static_cast<uint>(head.wrap_v),
                     map.channels,
                     first_channel,
                     head.channels(),
                     s.clusters,
                     s.polynomials ? 1u : 0u,
                     at->views,
                     at->lights,
                     at->pairs,
                     head.lights,
                     lobe_scale_word,
                     term_scale_word,
                     term_word,
                     writer.first_word(),
                     static_cast<uint>(s.lobes),
                     static_cast<uint>(s.terms),
                     table.rows_per_slot()};
  });
  return item;
}

}  // namespace btfc
