// Model pcarf: its cost and its params.
#include "format/models/pcarf_payload.h"

#include "format/table_model.h"
#include "shaders/models/pcarf.h"

namespace btfc {
namespace {

constexpr auto kSizeOptions = with_table_options(kWeightedOptions);

}  // namespace

const std::span<const OptionSpec> kPcarfSizeOptions = kSizeOptions;

Result<ItemDescription> pcarf_describe(const OptionValues& options) {
  return weighted_describe(kPcarfModel, options);
}

Result<Layout> pcarf_layout(const Head& head, ByteView parm) {
  const Result<WeightedShape> shape = read_weighted_parm(kPcarfModel, head, parm);
  if (!shape) return shape.error();
  Result<Layout> layout = weighted_layout(kPcarfModel, head, *shape);
  const auto [channels, views, lights, pair] = cost_terms(head);
  const std::uint64_t rank = shape->rank, elements = channels * (rank + 1);
  // A view and weight: a product and a sum a light, its scale, the view's share. An element then: its scale
  // and two words of that, the weight.
  layout->cost = TexelCost{views * (rank * (2 * lights + 3) + 4 * elements),
                           views * (rank * (lights * (1 + pair) + 2) + 3 * elements)};
  return layout;
}

Result<LoadedItem> pcarf_load(const Head& head, ByteView parm, const ChunkReader& read,
                              std::uint32_t levels) {
  Result<WeightedItem> loaded = weighted_load(kPcarfModel, head, parm, read, levels);
  if (!loaded) return loaded.error();
  const WeightedItem& w = *loaded;
  append_map_params(loaded->item, [&](const Map& map, std::uint32_t first_channel) {
    return PcarfParams{head.width,
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
                       w.weight_scale,
                       w.weight_word,
                       static_cast<uint>(w.shape.texels),
                       static_cast<uint>(w.shape.tables),
                       w.rows_per_slot};
  });
  return std::move(loaded->item);
}

}  // namespace btfc
