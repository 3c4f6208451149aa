// Chunks, words and sizes of model ptm.
#include "format/models/ptm_payload.h"

#include <fmt/format.h>

#include "format/limits.h"
#include "format/row_table.h"
#include "format/table_model.h"
#include "shaders/models/ptm.h"

namespace btfc {
namespace {

constexpr std::uint32_t kCoef = four_cc("COEF");
constexpr std::uint32_t kChunkTypes[] = {kCoef, kDirs};
constexpr std::uint64_t kParmBytes = 4;

constexpr OptionSpec kOwnOptions[] = {
    {"precision", "f32|f16|u8", "of the coefficients (default f32)"},
};
constexpr auto kSizeOptions = with_table_options(kOwnOptions);

// Of one view, for so many channels.
CheckedSize level_bytes(const Head& head, std::uint32_t channels, const PtmShape& s, std::uint32_t level) {
  const std::uint64_t terms = kPtmFirstTerm[level + 1] - kPtmFirstTerm[level];
  return coded_rows_bytes(terms * channels, head.texels(), s.precision);
}

RowTable coefficient_rows(const Head& head, const PtmShape& s, std::uint32_t terms) {
  return {head.views * head.texels(), std::uint64_t{terms} * head.channels(), s.precision, 1, 3};
}

// Words of slot 0.
std::uint64_t table_words(const Head& head) {
  return direction_words(head) + 2 * std::uint64_t{kPtmTerms} * head.channels() * head.views;
}

ChunkKey level_key(std::uint32_t view, std::uint32_t level) {
  return {kCoef, kPayloadChunk, static_cast<std::uint8_t>(level), 0, view};
}

}  // namespace

const std::span<const std::uint32_t> kPtmChunkTypes = kChunkTypes;
const std::span<const OptionSpec> kPtmSizeOptions = kSizeOptions;

Bytes write_ptm_parm(const PtmShape& s) {
  Bytes parm(kParmBytes);
  parm[0] = static_cast<std::uint8_t>(s.precision);
  return parm;
}

Result<PtmShape> read_ptm_parm(const Head& head, ByteView parm) {
  if (parm.size() != kParmBytes || parm[0] > 2 || parm[1] != 0 || parm[2] != 0 || parm[3] != 0)
    return invalid("PT1", 0, "PARM is not 4 bytes with a precision of 0 to 2 and its reserved bytes 0");
  const PtmShape s{static_cast<Precision>(parm[0])};
  if (const auto checked = check_table_head(head); !checked) return checked.error();
  if (level_bytes(head, head.channels(), s, kPtmLevels - 1).saturated() > kMaxChunkBytes ||
      !coefficient_rows(head, s, kPtmTerms).fits()) {
    return invalid("PT2", 0,
                   fmt::format("{}x{} texels of {} channels under {} views need chunks above 2^27 bytes or "
                               "more than three word slots of 2^27 bytes",
                               head.width, head.height, head.channels(), head.views));
  }
  return s;
}

std::uint64_t ptm_formula_bits(const Head& head, const PtmShape& s) {
  std::uint64_t view = 0;
  for (std::uint32_t level = 0; level < kPtmLevels; ++level)
    view += level_bytes(head, head.channels(), s, level).value();
  return 8 * (kParmBytes + head.views * view);
}

std::uint64_t ptm_memory_bits(const Head& head, const PtmShape& s) {
  return 32 * (table_words(head) + coefficient_rows(head, s, kPtmTerms).words());
}

std::uint64_t ptm_paper_values(const Head& head) { return 6 * head.channels() * head.texels() * head.views; }

std::vector<RawChunk> ptm_write(const Head& head, const PtmShape& s, const PtmPayload& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_ptm_parm(s));
  for (std::uint32_t level = 0; level < kPtmLevels; ++level) {
    for (std::uint32_t view = 0; view < head.views; ++view)
      chunks.push_back({level_key(view, level), write_coded_rows(payload.views[view][level])});
  }
  return chunks;
}

Result<PtmView> read_ptm_view(const Head& head, const PtmShape& s, const ChunkReader& read,
                              std::uint32_t view, std::uint32_t levels) {
  PtmView coded;
  for (std::uint32_t level = 0; level < levels; ++level) {
    const std::uint64_t terms = kPtmFirstTerm[level + 1] - kPtmFirstTerm[level];
    Result<CodedRows> rows =
        read_rows(read, level_key(view, level), terms * head.channels(), head.texels(), s.precision, "PT3");
    if (!rows) return rows.error();
    coded[level] = *std::move(rows);
  }
  return coded;
}

Result<ItemDescription> ptm_describe(const OptionValues& options) {
  const auto shape_for = [&](const Head&) -> Result<PtmShape> {
    const auto precision = parse_precision(options, "precision", Precision::f32);
    if (!precision) return precision.error();
    return PtmShape{*precision};
  };
  return describe_table(ModelId::ptm, options, shape_for, write_ptm_parm, read_ptm_parm);
}

Result<Layout> ptm_layout(const Head& head, ByteView parm) {
  const Result<PtmShape> shape = read_ptm_parm(head, parm);
  if (!shape) return shape.error();
  const PtmShape& s = *shape;
  Layout layout;
  layout.chunks = {directions_chunk(head), {{kParm, kPayloadChunk}, kParmBytes}};
  for (std::uint32_t level = 0; level < kPtmLevels; ++level) {
    const std::uint64_t bytes = level_bytes(head, head.channels(), s, level).value();
    for (std::uint32_t view = 0; view < head.views; ++view)
      layout.chunks.push_back({level_key(view, level), bytes});
  }
  layout.formula_bits = ptm_formula_bits(head, s);
  layout.memory_bits = ptm_memory_bits(head, s);
  layout.paper = survey_count(head, ptm_paper_values(head));
  // The light's unit vector and products; for each view and channel a scale, a product and a sum a term, and
  // the view's share. A term reads its element and the two words of its scale.
  const CostTerms cost = cost_terms(head);
  const std::uint64_t sums = cost.views * cost.channels;
  layout.cost = TexelCost{9 + 3 + sums * (4 * kPtmTerms + 2), sums * 3 * kPtmTerms};
  layout.parameters = {{"precision", name_of(s.precision), false}};
  for (const Map& map : head.maps) {
    std::uint64_t view = 0;
    for (std::uint32_t level = 0; level < kPtmLevels; ++level)
      view += level_bytes(head, map.channels, s, level).value();
    layout.map_bits.push_back(8 * head.views * view);
  }
  return layout;
}

Result<LoadedItem> ptm_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels) {
  const Result<PtmShape> shape = read_ptm_parm(head, parm);
  if (!shape) return shape.error();
  const std::uint32_t held = std::min(levels, kPtmLevels - 1) + 1, terms = kPtmFirstTerm[held];
  LoadedItem item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();

  const RowTable table = coefficient_rows(head, *shape, terms);
  RowTableWriter rows(table, item);
  const auto scale_word = static_cast<std::uint32_t>(item.words[0].size());
  const std::uint64_t texels = head.texels(), channels = head.channels();
  for (std::uint32_t view = 0; view < head.views; ++view) {
    const Result<PtmView> coded = read_ptm_view(head, *shape, read, view, held);
    if (!coded) return coded.error();
    for (std::uint32_t level = 0; level < held; ++level) {
      const CodedRows& from = (*coded)[level];
      append_scales(from.scales, item.words[0]);
      for (std::uint64_t r = 0; r < from.rows; ++r) {
        for (std::uint64_t t = 0; t < texels; ++t)
          rows.set(view * texels + t, kPtmFirstTerm[level] * channels + r, from.elements[r * texels + t]);
      }
    }
  }

  append_map_params(item, [&](const Map& map, std::uint32_t first_channel) {
    return PtmParams{head.width,
                     head.height,
                     static_cast<uint>(head.wrap_u),
                     static_cast<uint>(head.wrap_v),
                     map.channels,
                     first_channel,
                     head.channels(),
                     terms,
                     at->views,
                     scale_word,
                     static_cast<uint>(shape->precision),
                     table.rows_per_slot()};
  });
  return item;
}

}  // namespace btfc
