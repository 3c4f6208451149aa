// Chunks, words and sizes of sets of weighted images.
#include "format/models/weighted_images.h"

#include <fmt/format.h>

#include "format/limits.h"
#include "format/row_table.h"
#include "format/table_model.h"

namespace btfc {
namespace {

constexpr std::uint32_t kImag = kWeightedChunkTypes[1], kMean = kWeightedChunkTypes[2],
                        kWght = kWeightedChunkTypes[3];
constexpr std::uint64_t kParmBytes = 8;

CheckedSize image_bytes(const Head& head, const WeightedShape& s) {
  return coded_rows_bytes(head.channels(), head.texels(), s.texels);
}
CheckedSize weight_bytes(const Head& head, const WeightedShape& s) {
  return coded_rows_bytes(1, head.pairs, s.tables);
}

RowTable texel_rows(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  return {model.sets(head) * head.texels(), std::uint64_t{s.rank + 1} * head.channels(), s.texels, 1, 3};
}

std::uint64_t scale_count(const WeightedModel& model, const Head& head, std::uint32_t rank) {
  return std::uint64_t{model.sets(head)} * (rank + 1) * head.channels() + rank;
}

// Words of slot 0.
std::uint64_t table_words(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  return direction_words(head) + 2 * scale_count(model, head, s.rank) +
         element_words(std::uint64_t{s.rank} * head.pairs, s.tables);
}

std::vector<ChunkSpec> chunks_of(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  std::vector<ChunkSpec> chunks = {directions_chunk(head), {{kParm, kPayloadChunk}, kParmBytes}};
  for (std::uint32_t v = 0; v < model.sets(head); ++v)
    chunks.push_back({{kMean, kPayloadChunk, 0, 0, v}, image_bytes(head, s).saturated()});
  for (std::uint32_t k = 1; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    for (std::uint32_t v = 0; v < model.sets(head); ++v)
      chunks.push_back({{kImag, kPayloadChunk, level, 0, v}, image_bytes(head, s).saturated()});
    chunks.push_back({{kWght, kPayloadChunk, level}, weight_bytes(head, s).saturated()});
  }
  return chunks;
}

// Component k (0: the mean) of every texel's row, in the rows of one set.
void place_image(const CodedRows& image, std::uint32_t set, std::uint32_t k, RowTableWriter& rows) {
  for (std::uint64_t c = 0; c < image.rows; ++c) {
    for (std::uint64_t t = 0; t < image.columns; ++t)
      rows.set(set * image.columns + t, k * image.rows + c, image.elements[c * image.columns + t]);
  }
}

}  // namespace

Result<WeightedShape> weighted_shape_from_options(const OptionValues& options) {
  const auto rank = parse_u32(options, "rank", 0, kMostRank);
  if (!rank) return rank.error();
  const auto precisions = parse_precisions(options);
  if (!precisions) return precisions.error();
  return WeightedShape{rank->value_or(8), precisions->texels, precisions->tables};
}

Bytes write_weighted_parm(const WeightedShape& s) {
  Bytes parm(kParmBytes);
  store_u32(&parm[0], s.rank);
  parm[4] = static_cast<std::uint8_t>(s.texels);
  parm[5] = static_cast<std::uint8_t>(s.tables);
  return parm;
}

Result<WeightedShape> read_weighted_parm(const WeightedModel& model, const Head& head, ByteView parm) {
  if (parm.size() != kParmBytes || parm[4] > 2 || parm[5] > 2 || load_u16(&parm[6]) != 0)
    return invalid(model.parm_rule, 0, "PARM is not 8 bytes with precisions 0 to 2 and its reserved bytes 0");
  const WeightedShape s{load_u32(&parm[0]), static_cast<Precision>(parm[4]), static_cast<Precision>(parm[5])};
  if (s.rank > kMostRank)
    return invalid(model.parm_rule, 0,
                   fmt::format("PARM has rank {}, expected at most {}", s.rank, kMostRank));
  if (const auto checked = check_table_head(head); !checked) return checked.error();
  if (image_bytes(head, s).saturated() > kMaxChunkBytes ||
      weight_bytes(head, s).saturated() > kMaxChunkBytes ||
      4 * table_words(model, head, s) > kMaxChunkBytes || !texel_rows(model, head, s).fits()) {
    return invalid(model.size_rule, 0,
                   fmt::format("{}x{} texels of {} channels with {} components and {} pairs need more than "
                               "2^27 bytes a chunk or word slot",
                               head.width, head.height, head.channels(), s.rank, head.pairs));
  }
  return s;
}

std::uint64_t weighted_formula_bits(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  return 8 * (kParmBytes + model.sets(head) * (s.rank + 1) * image_bytes(head, s).value() +
              s.rank * weight_bytes(head, s).value());
}

std::uint64_t weighted_memory_bits(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  return 32 * (table_words(model, head, s) + texel_rows(model, head, s).words());
}

std::uint64_t weighted_paper_values(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  return model.sets(head) * head.channels() * head.texels() * (s.rank + 1) +
         std::uint64_t{s.rank} * head.pairs;
}

std::vector<RawChunk> weighted_write(const WeightedModel& model, const Head& head, const WeightedShape& s,
                                     const WeightedImages& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_weighted_parm(s));
  for (std::uint32_t v = 0; v < model.sets(head); ++v)
    chunks.push_back({{kMean, kPayloadChunk, 0, 0, v}, write_coded_rows(payload.means[v])});
  for (std::uint32_t k = 0; k < s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k + 1);
    for (std::uint32_t v = 0; v < model.sets(head); ++v)
      chunks.push_back({{kImag, kPayloadChunk, level, 0, v}, write_coded_rows(payload.images[k][v])});
    chunks.push_back({{kWght, kPayloadChunk, level}, write_coded_rows(payload.weights[k])});
  }
  return chunks;
}

Result<ItemDescription> weighted_describe(const WeightedModel& model, const OptionValues& options) {
  const auto shape_for = [&](const Head&) { return weighted_shape_from_options(options); };
  const auto read = [&](const Head& head, ByteView parm) { return read_weighted_parm(model, head, parm); };
  return describe_table(model.id, options, shape_for, write_weighted_parm, read);
}

Result<Layout> weighted_layout(const WeightedModel& model, const Head& head, const WeightedShape& s) {
  Layout layout;
  layout.chunks = chunks_of(model, head, s);
  layout.formula_bits = weighted_formula_bits(model, head, s);
  layout.memory_bits = weighted_memory_bits(model, head, s);
  layout.paper = survey_count(head, weighted_paper_values(model, head, s));
  layout.parameters = {{"rank", std::to_string(s.rank)},
                       {"texel_precision", name_of(s.texels), false},
                       {"table_precision", name_of(s.tables), false}};
  for (const Map& map : head.maps)
    layout.map_bits.push_back(8 * model.sets(head) * (s.rank + 1) *
                              coded_rows_bytes(map.channels, head.texels(), s.texels).value());
  return layout;
}

Result<Bytes> weighted_reduced(const WeightedModel& model, const Head& head, ByteView parm,
                               const Knobs& knobs) {
  Result<WeightedShape> shape = read_weighted_parm(model, head, parm);
  if (!shape) return shape.error();
  if (knobs.levels != 0) shape->rank = std::min(shape->rank, knobs.levels - 1);
  return write_weighted_parm(*shape);
}

Result<WeightedItem> weighted_load(const WeightedModel& model, const Head& head, ByteView parm,
                                   const ChunkReader& read, std::uint32_t levels) {
  const Result<WeightedShape> shape = read_weighted_parm(model, head, parm);
  if (!shape) return shape.error();
  WeightedItem loaded;
  WeightedShape& s = loaded.shape;
  s = *shape;
  s.rank = std::min(s.rank, levels);
  LoadedItem& item = loaded.item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();
  loaded.at = *at;

  const RowTable table = texel_rows(model, head, s);
  RowTableWriter rows(table, item);
  const std::uint64_t stride = std::uint64_t{s.rank + 1} * head.channels();
  std::vector<RowScale> scales(model.sets(head) * stride), weight_scales;
  std::vector<CodedRows> weights;
  for (std::uint32_t k = 0; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    for (std::uint32_t v = 0; v < model.sets(head); ++v) {
      const Result<CodedRows> image = read_rows(read, {k == 0 ? kMean : kImag, kPayloadChunk, level, 0, v},
                                                head.channels(), head.texels(), s.texels, model.rows_rule);
      if (!image) return image.error();
      place_image(*image, v, k, rows);
      std::copy(image->scales.begin(), image->scales.end(),
                scales.begin() + static_cast<std::ptrdiff_t>(v * stride + k * head.channels()));
    }
    if (k == 0) continue;
    Result<CodedRows> row =
        read_rows(read, {kWght, kPayloadChunk, level}, 1, head.pairs, s.tables, model.rows_rule);
    if (!row) return row.error();
    weight_scales.push_back(row->scales[0]);
    weights.push_back(*std::move(row));
  }
  loaded.scale_word = static_cast<std::uint32_t>(item.words[0].size());
  loaded.weight_scale = static_cast<std::uint32_t>(scales.size());
  append_scales(scales, item.words[0]);
  append_scales(weight_scales, item.words[0]);
  ElementWriter alpha(item.words[0], std::uint64_t{s.rank} * head.pairs, s.tables);
  for (std::uint32_t k = 0; k < s.rank; ++k) {
    for (std::uint64_t pair = 0; pair < head.pairs; ++pair)
      alpha.set(pair * s.rank + k, weights[k].elements[pair]);
  }
  loaded.weight_word = alpha.first_word();
  loaded.rows_per_slot = table.rows_per_slot();
  return loaded;
}

}  // namespace btfc
