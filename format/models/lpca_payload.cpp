// Chunks, words and sizes of model lpca.
#include "format/models/lpca_payload.h"

#include <fmt/format.h>

#include "format/limits.h"
#include "format/row_table.h"
#include "format/table_model.h"
#include "shaders/models/lpca.h"

namespace btfc {
namespace {

constexpr std::uint32_t kClus = four_cc("CLUS"), kCmea = four_cc("CMEA"), kCvec = four_cc("CVEC"),
                        kCwgt = four_cc("CWGT");
constexpr std::uint32_t kChunkTypes[] = {kClus, kCmea, kCvec, kCwgt, kDirs};
constexpr std::uint64_t kParmBytes = 12;

constexpr OptionSpec kOwnOptions[] = {
    {"clusters", "C", "clusters c of texels, 1 to 65536 (default 8)"},
    {"rank", "K", "components k beside the mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of texels and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the clusters' means and eigenvectors (default: as --precision)"},
};
constexpr auto kSizeOptions = with_table_options(kOwnOptions);

std::uint32_t cluster_bytes(const LpcaShape& s) { return s.clusters <= 256 ? 1 : 2; }

CheckedSize index_bytes(const Head& head, const LpcaShape& s) {
  return align_up(CheckedSize(head.texels()) * CheckedSize(cluster_bytes(s)), 2);
}
// Means, or one component's eigenvectors.
CheckedSize vector_bytes(const Head& head, const LpcaShape& s) {
  return coded_rows_bytes(std::uint64_t{s.clusters} * head.channels(), head.pairs, s.tables);
}
CheckedSize weight_bytes(const Head& head, const LpcaShape& s) {
  return coded_rows_bytes(1, head.texels(), s.texels);
}

RowTable texel_rows(const Head& head, const LpcaShape& s) {
  return {head.texels(), s.rank, s.texels, LPCA_TEXELS, 1};
}
RowTable vector_rows(const Head& head, const LpcaShape& s) {
  return {std::uint64_t{s.clusters} * head.pairs, std::uint64_t{s.rank + 1} * head.channels(), s.tables,
          LPCA_REFLECTANCE, 2};
}

// Words of slot 0.
std::uint64_t table_words(const Head& head, const LpcaShape& s) {
  const std::uint64_t scales = std::uint64_t{s.clusters} * (s.rank + 1) * head.channels() + s.rank;
  return direction_words(head) + 2 * scales + index_bytes(head, s).value() / 4;
}

std::vector<ChunkSpec> chunks_of(const Head& head, const LpcaShape& s) {
  std::vector<ChunkSpec> chunks = {directions_chunk(head),
                                   {{kParm, kPayloadChunk}, kParmBytes},
                                   {{kClus, kPayloadChunk}, index_bytes(head, s).saturated()},
                                   {{kCmea, kPayloadChunk}, vector_bytes(head, s).saturated()}};
  for (std::uint32_t k = 1; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    chunks.push_back({{kCvec, kPayloadChunk, level}, vector_bytes(head, s).saturated()});
    chunks.push_back({{kCwgt, kPayloadChunk, level}, weight_bytes(head, s).saturated()});
  }
  return chunks;
}

Bytes pack_clusters(const Head& head, const LpcaShape& s, std::span<const std::uint16_t> cluster) {
  Bytes raw(index_bytes(head, s).value());
  for (std::size_t t = 0; t < cluster.size(); ++t) {
    if (cluster_bytes(s) == 1) {
      raw[t] = static_cast<std::uint8_t>(cluster[t]);
    } else {
      store_u16(&raw[2 * t], cluster[t]);
    }
  }
  return raw;
}

// Rule LP4.
std::optional<Error> cluster_fault(const Head& head, const LpcaShape& s, ByteView raw) {
  const std::size_t bytes = cluster_bytes(s);
  for (std::size_t i = 0; i < raw.size() / bytes; ++i) {
    const std::uint32_t cluster = bytes == 1 ? raw[i] : load_u16(&raw[2 * i]);
    const bool padding = i >= head.texels();
    if (padding ? cluster != 0 : cluster >= s.clusters) {
      return invalid("LP4", 0,
                     fmt::format("entry {} of CLUS is {}, expected {}", i, cluster,
                                 padding ? std::string("0, as padding is")
                                         : fmt::format("a cluster below {}", s.clusters)));
    }
  }
  return std::nullopt;
}

}  // namespace

const std::span<const std::uint32_t> kLpcaChunkTypes = kChunkTypes;
const std::span<const OptionSpec> kLpcaSizeOptions = kSizeOptions;

Result<LpcaShape> lpca_shape_from_options(const OptionValues& options) {
  const auto clusters = parse_u32(options, "clusters", 1, kLpcaMostClusters);
  if (!clusters) return clusters.error();
  const auto rank = parse_u32(options, "rank", 0, kLpcaMostRank);
  if (!rank) return rank.error();
  const auto precisions = parse_precisions(options);
  if (!precisions) return precisions.error();
  return LpcaShape{clusters->value_or(8), rank->value_or(8), precisions->texels, precisions->tables};
}

Bytes write_lpca_parm(const LpcaShape& s) {
  Bytes parm(kParmBytes);
  store_u32(&parm[0], s.clusters);
  store_u32(&parm[4], s.rank);
  parm[8] = static_cast<std::uint8_t>(s.texels);
  parm[9] = static_cast<std::uint8_t>(s.tables);
  return parm;
}

Result<LpcaShape> read_lpca_parm(const Head& head, ByteView parm) {
  if (parm.size() != kParmBytes || parm[8] > 2 || parm[9] > 2 || load_u16(&parm[10]) != 0)
    return invalid("LP1", 0, "PARM is not 12 bytes with precisions 0 to 2 and its reserved bytes 0");
  const LpcaShape s{load_u32(&parm[0]), load_u32(&parm[4]), static_cast<Precision>(parm[8]),
                    static_cast<Precision>(parm[9])};
  if (s.clusters < 1 || s.clusters > kLpcaMostClusters || s.rank > kLpcaMostRank) {
    return invalid("LP1", 0,
                   fmt::format("PARM has {} clusters of rank {}, expected 1 to {} of at most {}", s.clusters,
                               s.rank, kLpcaMostClusters, kLpcaMostRank));
  }
  if (const auto checked = check_table_head(head); !checked) return checked.error();
  if (index_bytes(head, s).saturated() > kMaxChunkBytes ||
      vector_bytes(head, s).saturated() > kMaxChunkBytes ||
      weight_bytes(head, s).saturated() > kMaxChunkBytes || 4 * table_words(head, s) > kMaxChunkBytes ||
      !texel_rows(head, s).fits() || !vector_rows(head, s).fits()) {
    return invalid("LP2", 0,
                   fmt::format("{}x{} texels of {} channels in {} clusters with {} components and {} pairs "
                               "need more than 2^27 bytes a chunk or word slot",
                               head.width, head.height, head.channels(), s.clusters, s.rank, head.pairs));
  }
  return s;
}

std::uint64_t lpca_formula_bits(const Head& head, const LpcaShape& s) {
  return 8 * (kParmBytes + index_bytes(head, s).value() + (s.rank + 1) * vector_bytes(head, s).value() +
              s.rank * weight_bytes(head, s).value());
}

std::uint64_t lpca_memory_bits(const Head& head, const LpcaShape& s) {
  return 32 * (table_words(head, s) + texel_rows(head, s).words() + vector_rows(head, s).words());
}

std::uint64_t lpca_paper_values(const Head& head, const LpcaShape& s) {
  return head.texels() + std::uint64_t{head.channels()} * s.clusters * head.pairs * (s.rank + 1);
}

std::vector<RawChunk> lpca_write(const Head& head, const LpcaShape& s, const LpcaPayload& payload) {
  std::vector<RawChunk> chunks = table_chunks(head, payload.directions, write_lpca_parm(s));
  chunks.push_back({{kClus, kPayloadChunk}, pack_clusters(head, s, payload.cluster)});
  chunks.push_back({{kCmea, kPayloadChunk}, write_coded_rows(payload.means)});
  for (std::uint32_t k = 0; k < s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k + 1);
    chunks.push_back({{kCvec, kPayloadChunk, level}, write_coded_rows(payload.vectors[k])});
    chunks.push_back({{kCwgt, kPayloadChunk, level}, write_coded_rows(payload.weights[k])});
  }
  return chunks;
}

Result<ItemDescription> lpca_describe(const OptionValues& options) {
  const auto shape_for = [&](const Head&) { return lpca_shape_from_options(options); };
  return describe_table(ModelId::lpca, options, shape_for, write_lpca_parm, read_lpca_parm);
}

Result<Layout> lpca_layout(const Head& head, ByteView parm) {
  const Result<LpcaShape> shape = read_lpca_parm(head, parm);
  if (!shape) return shape.error();
  const LpcaShape& s = *shape;
  Layout layout;
  layout.chunks = chunks_of(head, s);
  layout.formula_bits = lpca_formula_bits(head, s);
  layout.memory_bits = lpca_memory_bits(head, s);
  layout.paper = survey_count(head, lpca_paper_values(head, s));
  // What Table 7 counts.
  const PaperCount counted = survey_count(head, lpca_paper_values(head, s) + s.rank * head.texels());
  layout.paper->counts.push_back({"values_with_weights", counted.counts[0].value});
  layout.paper->counts.push_back({"ratio_with_weights", counted.counts[2].value});
  // A vector: nine products of corner weights, and for each channel a product and a sum a pair, and a scale.
  // Then the texel's weight of it with its scale, and a product and a sum a channel; of the mean neither.
  const auto [channels, views, lights, pair] = cost_terms(head);
  const std::uint64_t rank = s.rank, pairs = views * lights;
  layout.cost = TexelCost{(rank + 1) * (9 + channels * (2 * pairs + 2)) + rank * (2 + 2 * channels),
                          1 + (rank + 1) * (pairs * (channels + pair) + 2 * channels) + 3 * rank};
  layout.parameters = {{"clusters", std::to_string(s.clusters)},
                       {"rank", std::to_string(s.rank)},
                       {"texel_precision", name_of(s.texels), false},
                       {"table_precision", name_of(s.tables), false}};
  for (const Map& map : head.maps) {
    layout.map_bits.push_back(
        8 * (s.rank + 1) *
        coded_rows_bytes(std::uint64_t{s.clusters} * map.channels, head.pairs, s.tables).value());
  }
  return layout;
}

Result<Bytes> lpca_reduced(const Head& head, ByteView parm, const Knobs& knobs) {
  Result<LpcaShape> shape = read_lpca_parm(head, parm);
  if (!shape) return shape.error();
  if (knobs.levels != 0) shape->rank = std::min(shape->rank, knobs.levels - 1);
  return write_lpca_parm(*shape);
}

Result<LoadedItem> lpca_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels) {
  const Result<LpcaShape> shape = read_lpca_parm(head, parm);
  if (!shape) return shape.error();
  LpcaShape s = *shape;
  s.rank = std::min(s.rank, levels);
  LoadedItem item;
  const Result<DirectionWords> at = begin_table_item(head, read, item);
  if (!at) return at.error();
  const Result<Bytes> clusters = read({kClus, kPayloadChunk});
  if (!clusters) return clusters.error();
  if (auto fault = cluster_fault(head, s, *clusters)) return *fault;
  const auto cluster_word = static_cast<std::uint32_t>(item.words[0].size());
  const std::vector<std::uint32_t> cluster_words = to_words(*clusters);
  item.words[0].insert(item.words[0].end(), cluster_words.begin(), cluster_words.end());

  const RowTable vectors = vector_rows(head, s);
  RowTableWriter vector_writer(vectors, item), weight_writer(texel_rows(head, s), item);
  const std::uint64_t channels = head.channels(), stride = (s.rank + 1) * channels;
  std::vector<RowScale> scales(s.clusters * stride), weight_scales;
  for (std::uint32_t k = 0; k <= s.rank; ++k) {
    const auto level = static_cast<std::uint8_t>(k);
    const Result<CodedRows> rows = read_rows(read, {k == 0 ? kCmea : kCvec, kPayloadChunk, level},
                                             s.clusters * channels, head.pairs, s.tables, "LP3");
    if (!rows) return rows.error();
    for (std::uint64_t r = 0; r < rows->rows; ++r) {
      const std::uint64_t m = r / channels, c = r % channels;
      scales[m * stride + k * channels + c] = rows->scales[r];
      for (std::uint64_t pair = 0; pair < head.pairs; ++pair)
        vector_writer.set(m * head.pairs + pair, k * channels + c, rows->elements[r * head.pairs + pair]);
    }
    if (k == 0) continue;
    const Result<CodedRows> alpha =
        read_rows(read, {kCwgt, kPayloadChunk, level}, 1, head.texels(), s.texels, "LP3");
    if (!alpha) return alpha.error();
    weight_scales.push_back(alpha->scales[0]);
    for (std::uint64_t t = 0; t < head.texels(); ++t) weight_writer.set(t, k - 1, alpha->elements[t]);
  }
  const auto scale_word = static_cast<std::uint32_t>(item.words[0].size());
  append_scales(scales, item.words[0]);
  append_scales(weight_scales, item.words[0]);

  append_map_params(item, [&](const Map& map, std::uint32_t first_channel) {
    return LpcaParams{head.width,
                      head.height,
                      static_cast<uint>(head.wrap_u),
                      static_cast<uint>(head.wrap_v),
                      map.channels,
                      first_channel,
                      head.channels(),
                      s.rank,
                      at->views,
                      at->lights,
                      at->pairs,
                      head.lights,
                      head.pairs,
                      scale_word,
                      static_cast<uint>(scales.size()),
                      cluster_word,
                      8 * cluster_bytes(s),
                      static_cast<uint>(s.texels),
                      static_cast<uint>(s.tables),
                      vectors.rows_per_slot()};
  });
  return item;
}

}  // namespace btfc
