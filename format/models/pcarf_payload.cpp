// Chunks, words and sizes of model pcarf.
#include "format/models/pcarf_payload.h"

#include <fmt/format.h>

#include "format/limits.h"
#include "format/row_table.h"
#include "format/table_options.h"
#include "shaders/models/pcarf.h"

namespace btfc {
namespace {

constexpr std::uint32_t kMean = four_cc("MEAN"), kImag = four_cc("IMAG"), kWght = four_cc("WGHT");
constexpr std::uint32_t kChunkTypes[] = {kDirs, kImag, kMean, kWght};
constexpr std::uint16_t kPayloadFlags = kCritical | kPayload;
constexpr std::uint64_t kParmBytes = 8;

constexpr OptionSpec kOwnOptions[] = {
    {"rank", "K", "components k beside the mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of images and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the table of weights (default: as --precision)"},
};
constexpr auto kSizeOptions = with_table_options(kOwnOptions);

std::uint64_t texel_count(const Head& head) { return std::uint64_t{head.width} * head.height; }

CheckedSize image_bytes(const Head& head, const PcarfShape& s) {
  return coded_rows_bytes(head.channels(), texel_count(head), s.texels);
}
CheckedSize weight_bytes(const Head& head, const PcarfShape& s) {
  return coded_rows_bytes(1, head.pairs, s.tables);
}

RowTable texel_rows(const Head& head, const PcarfShape& s) {
  return {head.views * texel_count(head), std::uint64_t{s.rank + 1} * head.channels(), s.texels, 1, 3};
}

std::uint64_t scale_count(const Head& head, std::uint32_t rank) {
  return std::uint64_t{head.views} * (rank + 1) * head.channels() + rank;
}

// Words of slot 0.
std::uint64_t table_words(const Head& head, const PcarfShape& s) {
  return direction_words(head) + 2 * scale_count(head, s.rank) +
         element_words(std::uint64_t{s.rank} * head.pairs, s.tables);
}

std::vector<ChunkSpec> chunks_of(const Head& head, const PcarfShape& s) {
  std::vector<ChunkSpec> chunks = {directions_chunk(head), {{kParm, kPayloadFlags}, kParmBytes}};
  for (std::uint32_t v = 0; v < head.views; ++v)
    chunks.push_back({{kMean, kPayloadFlags, 0, 0, v}, image_bytes(head, s).saturated()});
  for (std::uint32_t k = 1; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    for (std::uint32_t v = 0; v < head.views; ++v)
      chunks.push_back({{kImag, kPayloadFlags, level, 0, v}, image_bytes(head, s).saturated()});
    chunks.push_back({{kWght, kPayloadFlags, level}, weight_bytes(head, s).saturated()});
  }
  return chunks;
}

Result<CodedRows> read_rows(const ChunkReader& read, const ChunkKey& key, std::uint64_t rows,
                            std::uint64_t columns, Precision precision) {
  const Result<Bytes> raw = read(key);
  if (!raw) return raw.error();
  return read_coded_rows(*raw, rows, columns, precision, "PF3",
                         fmt::format("{} of level {}, tile {}", type_name(key.type), key.level, key.tile));
}

// Component k (0: the mean) of every texel's row, in the rows of one view.
void place_image(const CodedRows& image, std::uint32_t view, std::uint32_t k, RowTableWriter& rows) {
  for (std::uint64_t c = 0; c < image.rows; ++c) {
    for (std::uint64_t t = 0; t < image.columns; ++t)
      rows.set(view * image.columns + t, k * image.rows + c, image.elements[c * image.columns + t]);
  }
}

}  // namespace

const std::span<const std::uint32_t> kPcarfChunkTypes = kChunkTypes;
const std::span<const OptionSpec> kPcarfSizeOptions = kSizeOptions;

Bytes write_pcarf_parm(const PcarfShape& s) {
  Bytes parm(kParmBytes);
  store_u32(&parm[0], s.rank);
  parm[4] = static_cast<std::uint8_t>(s.texels);
  parm[5] = static_cast<std::uint8_t>(s.tables);
  return parm;
}

Result<PcarfShape> read_pcarf_parm(const Head& head, ByteView parm) {
  if (parm.size() != kParmBytes || parm[4] > 2 || parm[5] > 2 || load_u16(&parm[6]) != 0)
    return invalid("PF1", 0, "PARM is not 8 bytes with precisions 0 to 2 and its reserved bytes 0");
  const PcarfShape s{load_u32(&parm[0]), static_cast<Precision>(parm[4]), static_cast<Precision>(parm[5])};
  if (s.rank > kPcarfMostRank)
    return invalid("PF1", 0, fmt::format("PARM has rank {}, expected at most {}", s.rank, kPcarfMostRank));
  if (const auto checked = check_table_head(head); !checked) return checked.error();
  if (image_bytes(head, s).saturated() > kMaxChunkBytes ||
      weight_bytes(head, s).saturated() > kMaxChunkBytes || 4 * table_words(head, s) > kMaxChunkBytes ||
      !texel_rows(head, s).fits()) {
    return invalid("PF2", 0,
                   fmt::format("{}x{} texels of {} channels with {} components and {} pairs need more than "
                               "2^27 bytes a chunk or word slot",
                               head.width, head.height, head.channels(), s.rank, head.pairs));
  }
  return s;
}

std::uint64_t pcarf_formula_bits(const Head& head, const PcarfShape& s) {
  return 8 * (kParmBytes + head.views * (s.rank + 1) * image_bytes(head, s).value() +
              s.rank * weight_bytes(head, s).value());
}

std::uint64_t pcarf_memory_bits(const Head& head, const PcarfShape& s) {
  return 32 * (table_words(head, s) + texel_rows(head, s).words());
}

std::uint64_t pcarf_paper_values(const Head& head, const PcarfShape& s) {
  return head.views * head.channels() * texel_count(head) * (s.rank + 1) + std::uint64_t{s.rank} * head.pairs;
}

std::vector<RawChunk> pcarf_write(const Head& head, const PcarfShape& s, const PcarfPayload& payload) {
  std::vector<RawChunk> chunks = {{{kHead, kCritical}, write_head(head)},
                                  {{kDirs, kCritical}, write_directions(payload.directions)},
                                  {{kParm, kPayloadFlags}, write_pcarf_parm(s)}};
  for (std::uint32_t v = 0; v < head.views; ++v)
    chunks.push_back({{kMean, kPayloadFlags, 0, 0, v}, write_coded_rows(payload.means[v])});
  for (std::uint32_t k = 0; k < s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k + 1);
    for (std::uint32_t v = 0; v < head.views; ++v)
      chunks.push_back({{kImag, kPayloadFlags, level, 0, v}, write_coded_rows(payload.images[k][v])});
    chunks.push_back({{kWght, kPayloadFlags, level}, write_coded_rows(payload.weights[k])});
  }
  return chunks;
}

Result<ItemDescription> pcarf_describe(const OptionValues& options) {
  const Result<Head> head = table_head(ModelId::pcarf, options);
  if (!head) return head.error();
  const auto rank = parse_u32(options, "rank", 0, kPcarfMostRank);
  if (!rank) return rank.error();
  const auto precision = parse_precision(options, "precision", Precision::f32);
  if (!precision) return precision.error();
  const auto tables = parse_precision(options, "table-precision", *precision);
  if (!tables) return tables.error();
  const Bytes parm = write_pcarf_parm({rank->value_or(8), *precision, *tables});
  if (const auto shape = read_pcarf_parm(*head, parm); !shape) return as_usage(shape.error());
  return ItemDescription{*head, parm};
}

Result<Layout> pcarf_layout(const Head& head, ByteView parm) {
  const Result<PcarfShape> shape = read_pcarf_parm(head, parm);
  if (!shape) return shape.error();
  const PcarfShape& s = *shape;
  Layout layout;
  layout.chunks = chunks_of(head, s);
  layout.formula_bits = pcarf_formula_bits(head, s);
  layout.memory_bits = pcarf_memory_bits(head, s);
  layout.paper =
      table_paper("Filip, Haindl 2009 (survey), Table 6, 32 bits a value", head, pcarf_paper_values(head, s));
  // Three views: three weights times k, then a multiplication and an addition a component and channel.
  const std::uint64_t channels = head.channels();
  layout.cost = TexelCost{3 * (2 * 3 * std::uint64_t{s.rank} + 2 * channels * (s.rank + 1)),
                          3 * (3 * std::uint64_t{s.rank} + channels * (s.rank + 1))};
  layout.parameters = {{"rank", std::to_string(s.rank)},
                       {"texel_precision", name_of(s.texels), false},
                       {"table_precision", name_of(s.tables), false}};
  for (const Map& map : head.maps)
    layout.map_bits.push_back(8 * head.views * (s.rank + 1) *
                              coded_rows_bytes(map.channels, texel_count(head), s.texels).value());
  return layout;
}

Result<LoadedItem> pcarf_load(const Head& head, ByteView parm, const ChunkReader& read,
                              std::uint32_t levels) {
  const Result<PcarfShape> shape = read_pcarf_parm(head, parm);
  if (!shape) return shape.error();
  PcarfShape s = *shape;
  s.rank = std::min(s.rank, levels);
  LoadedItem item;
  item.head = head;
  const Result<Bytes> dirs = read({kDirs, kCritical});
  if (!dirs) return dirs.error();
  Result<Directions> directions = read_directions(head, *dirs);
  if (!directions) return directions.error();
  item.directions = *std::move(directions);
  const DirectionWords at = append_direction_words(item.directions, item.words[0]);

  const RowTable table = texel_rows(head, s);
  RowTableWriter rows(table, item);
  const std::uint64_t stride = std::uint64_t{s.rank + 1} * head.channels();
  std::vector<RowScale> scales(head.views * stride), weight_scales;
  std::vector<CodedRows> weights;
  for (std::uint32_t k = 0; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    for (std::uint32_t v = 0; v < head.views; ++v) {
      const Result<CodedRows> image = read_rows(read, {k == 0 ? kMean : kImag, kPayloadFlags, level, 0, v},
                                                head.channels(), texel_count(head), s.texels);
      if (!image) return image.error();
      place_image(*image, v, k, rows);
      std::copy(image->scales.begin(), image->scales.end(),
                scales.begin() + static_cast<std::ptrdiff_t>(v * stride + k * head.channels()));
    }
    if (k == 0) continue;
    Result<CodedRows> row = read_rows(read, {kWght, kPayloadFlags, level}, 1, head.pairs, s.tables);
    if (!row) return row.error();
    weight_scales.push_back(row->scales[0]);
    weights.push_back(*std::move(row));
  }
  const auto scale_word = static_cast<std::uint32_t>(item.words[0].size());
  append_scales(scales, item.words[0]);
  append_scales(weight_scales, item.words[0]);
  ElementWriter alpha(item.words[0], std::uint64_t{s.rank} * head.pairs, s.tables);
  for (std::uint32_t k = 0; k < s.rank; ++k) {
    for (std::uint64_t pair = 0; pair < head.pairs; ++pair)
      alpha.set(pair * s.rank + k, weights[k].elements[pair]);
  }

  std::uint32_t first_channel = 0;
  for (const Map& map : head.maps) {
    const PcarfParams params{head.width,
                             head.height,
                             static_cast<uint>(head.wrap_u),
                             static_cast<uint>(head.wrap_v),
                             map.channels,
                             first_channel,
                             head.channels(),
                             s.rank,
                             at.views,
                             at.lights,
                             at.pairs,
                             head.lights,
                             scale_word,
                             static_cast<uint>(scales.size()),
                             alpha.first_word(),
                             static_cast<uint>(s.texels),
                             static_cast<uint>(s.tables),
                             table.rows_per_slot()};
    item.map_params.push_back(params_words(params));
    first_channel += map.channels;
  }
  return item;
}

}  // namespace btfc
