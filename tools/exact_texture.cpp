// The table, packed and loaded as a file would be.
#include "tools/exact_texture.h"

#include <fmt/format.h>

#include <bit>
#include <numeric>

#include "encoder/dataset/dataset_head.h"
#include "format/container.h"
#include "format/limits.h"
#include "format/models/lpca_payload.h"

namespace btfc {
namespace {

// Rows are (texel, channel), columns pairs.
CodedRows table_of(const Dataset& dataset, Precision precision) {
  const DatasetInfo& info = dataset.info();
  const std::size_t channels = info.channel_count(), pairs = info.pairs.size();
  CodedRows table;
  table.precision = precision;
  table.rows = std::uint64_t{info.width} * info.height * channels;
  table.columns = pairs;
  table.scales.assign(table.rows, precision == Precision::u8 ? RowScale{0, 1.0f / 255} : RowScale{});
  table.elements.resize(table.rows * pairs);
  std::vector<std::uint16_t> codes(info.width * pairs * channels);
  std::uint32_t* row = table.elements.data();
  for (std::uint32_t y = 0; y < info.height; ++y) {
    dataset.read_texels(0, y, info.width, codes);
    for (std::size_t x = 0; x < info.width; ++x) {
      for (std::size_t channel = 0; channel < channels; ++channel, row += pairs) {
        for (std::size_t pair = 0; pair < pairs; ++pair) {
          const std::uint16_t code = codes[(x * pairs + pair) * channels + channel];
          row[pair] =
              precision == Precision::f32 ? std::bit_cast<std::uint32_t>(code_value(info.type, code)) : code;
        }
      }
    }
  }
  return table;
}

}  // namespace

Result<ExactTexture> exact_texture(const Dataset& dataset) {
  const DatasetInfo& info = dataset.info();
  const Result<DatasetHead> described = dataset_head(info, ModelId::lpca);
  if (!described) return described.error();
  const std::uint64_t texels = described->head.texels();
  LpcaShape shape;
  shape.tables = info.type == SampleType::unorm8    ? Precision::u8
                 : info.type == SampleType::float16 ? Precision::f16
                                                    : Precision::f32;
  shape.clusters = static_cast<std::uint32_t>(texels);
  const std::uint64_t bytes =
      texels * info.channel_count() * (info.pairs.size() * element_bytes(shape.tables) + sizeof(RowScale));
  if (texels > kLpcaMostClusters || bytes > kMaxChunkBytes) {
    return Error{
        Status::limit,
        fmt::format("{}x{} texels under {} pairs are a table of {} bytes, expected at most {} texels and {} "
                    "bytes: choose fewer texels by --crop",
                    info.width, info.height, info.pairs.size(), bytes, kLpcaMostClusters, kMaxChunkBytes),
        "", 0};
  }
  LpcaPayload payload;
  payload.directions = described->directions;
  payload.cluster.resize(texels);
  std::iota(payload.cluster.begin(), payload.cluster.end(), std::uint16_t{0});
  payload.means = table_of(dataset, shape.tables);
  std::vector<RawChunk> chunks = lpca_write(described->head, shape, payload);
  payload = {};
  PackOptions raw;
  raw.codec = Codec::raw;
  const Result<Bytes> file = pack_file(std::move(chunks), raw);
  if (!file) return file.error();

  btfc_error error{};
  btfc_reader* reader = nullptr;
  if (btfc_reader_open_memory(file->data(), file->size(), nullptr, &reader, &error) != BTFC_OK)
    return from_api(error);
  const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
  btfc_texture* texture = nullptr;
  if (btfc_texture_load(reader, nullptr, &texture, &error) != BTFC_OK) return from_api(error);
  return ExactTexture{described->head, TexturePtr(texture)};
}

}  // namespace btfc
