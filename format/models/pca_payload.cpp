// Model pca: its cost and its params.
#include "format/models/pca_payload.h"

#include "format/table_model.h"
#include "shaders/models/pca.h"

namespace btfc {
namespace {

constexpr auto kSizeOptions = with_table_options(kWeightedOptions);

}  // namespace

const std::span<const OptionSpec> kPcaSizeOptions = kSizeOptions;

Result<ItemDescription> pca_describe(const OptionValues& options) {
  return weighted_describe(kPcaModel, options);
}

Result<Layout> pca_layout(const Head& head, ByteView parm) {
  const Result<WeightedShape> shape = read_weighted_parm(kPcaModel, head, parm);
  if (!shape) return shape.error();
  Result<Layout> layout = weighted_layout(kPcaModel, head, *shape);
  const auto [channels, views, lights, pair] = cost_terms(head);
  const std::uint64_t rank = shape->rank, elements = channels * (rank + 1);
  // A weight: nine products of corner weights, a product and a sum a pair, its scale. An element of the
  // images then: its scale and two words of that, the weight.
  layout->cost = TexelCost{rank * (9 + 2 * views * lights + 2) + 4 * elements,
                           rank * (views * lights * (1 + pair) + 2) + 3 * elements};
  return layout;
}

Result<LoadedItem> pca_load(const Head& head, ByteView parm, const ChunkReader& read, std::uint32_t levels) {
  Result<WeightedItem> loaded = weighted_load(kPcaModel, head, parm, read, levels);
  if (!loaded) return loaded.error();
  const WeightedItem& w = *loaded;
  append_map_params(loaded->item, [&](const Map& map, std::uint32_t first_channel) {
    return PcaParams{head.width,
                     head.height,
                     static_cast<uint>(head.wrap_u),
                     static_cast<uint>(head.wrap_v),
                     map.channels,
                     first_channel,
                     head.channels(),
                     w.shape.rank,
                     w.at.views,
                     w.at.lights,
                     w.at.pairs,
                     head.lights,
                     w.scale_word,
                     w.weight_word,
                     static_cast<uint>(w.shape.texels),
                     static_cast<uint>(w.shape.tables),
                     w.rows_per_slot};
  });
  return std::move(loaded->item);
}

}  // namespace btfc
