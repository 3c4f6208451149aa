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
  const std::uint64_t channels = head.channels(), rank = shape->rank;
  // Three views: three weights times k, then a multiplication and an addition a component and channel.
  layout->cost =
      TexelCost{3 * (2 * 3 * rank + 2 * channels * (rank + 1)), 3 * (3 * rank + channels * (rank + 1))};
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
