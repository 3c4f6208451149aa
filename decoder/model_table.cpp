// The rows of the decoder's table: eval functions over the shared headers.
#include "decoder/model_table.h"

#include <algorithm>
#include <cstring>

#include "decoder/field_plan.h"
#include "decoder/field_values.h"
#include "decoder/gm_values.h"
#include "decoder/patch_rows.h"
#include "decoder/table_values.h"
#include "format/model_table.h"
#include "shaders/models/field.h"
#include "shaders/models/gm.h"
#include "shaders/models/lpca.h"
#include "shaders/models/patch.h"
#include "shaders/models/pca.h"
#include "shaders/models/pcarf.h"
#include "shaders/models/plm.h"
#include "shaders/models/ptm.h"

namespace btfc {
namespace {

template <class Params, vec4 (*eval)(const BtfcWords&, const Params&, const BtfcQuery&)>
vec4 eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  static_assert(sizeof(Params) <= 128);  // the uniform buffer of a map's parameters
  return eval(words_of(item), params_of<Params>(item, map), query);
}

// A run of texels by a model whose header splits eval into what depends on the directions alone and the rest:
// bit for bit what eval gives.
template <class Params, class State, State (*begin)(const BtfcWords&, const Params&, const BtfcQuery&)>
std::vector<float> begin_state(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  static_assert(sizeof(State) % sizeof(float) == 0);
  const State state = begin(words_of(item), params_of<Params>(item, map), query);
  std::vector<float> raw(sizeof(State) / sizeof(float));
  std::memcpy(raw.data(), &state, sizeof state);
  return raw;
}

template <class Params, class State, vec4 (*texel)(const BtfcWords&, const Params&, const State&, uint)>
void decode_with_state(const LoadedItem& item, std::uint32_t map, const std::vector<float>& raw,
                       const BtfcQuery& query, std::uint32_t width, float* out) {
  const auto params = params_of<Params>(item, map);
  const BtfcWords words = words_of(item);
  State state;
  std::memcpy(&state, raw.data(), sizeof state);
  const uint first = static_cast<uint>(query.texel.y) * params.width + static_cast<uint>(query.texel.x);
  for (std::uint32_t i = 0; i < width; ++i) {
    const vec4 value = texel(words, params, state, first + i);
    for (uint c = 0; c < params.channels; ++c) *out++ = value[static_cast<int>(c)];
  }
}

// A rectangle row by row.
template <void (*decode_row)(const LoadedItem&, std::uint32_t, const std::vector<float>&, const BtfcQuery&,
                             std::uint32_t, float*)>
void decode_by_rows(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                    const BtfcQuery& query, std::uint32_t width, std::uint32_t height, float* out) {
  BtfcQuery row = query;
  for (std::uint32_t r = 0; r < height; ++r, ++row.texel.y) {
    decode_row(item, map, state, row, width, out);
    out += std::size_t{width} * item.head.maps[map].channels;
  }
}

// Gates and culling are chosen at loading.
constexpr DecoderModel gm_row() {
  DecoderModel row{ModelId::gm, eval_cpu<GmParams, gm_eval>, false};
  row.begin_values = gm_begin_values;
  row.decode_values = gm_decode_values;
  row.eval_queries = gm_eval_queries;
  row.select = gm_select;
  row.most_gates = gm_most_gates;
  row.culls = true;
  return row;
}

// The random fields: tiles in a cache.
constexpr DecoderModel field_row(ModelId id) {
  DecoderModel row{id, eval_cpu<FieldParams, field_eval>, false};
  row.eval_queries = field_eval_queries;
  row.make_cache = field_make_cache;
  row.decode_cached = field_decode_cached;
  row.select = field_select;
  row.prepare = field_prepare;
  row.fixed_params = offsetof(FieldParams, atlas_x) / sizeof(uint);
  return row;
}

const DecoderModel kDecoders[] = {
    {ModelId::patch, eval_cpu<PatchParams, patch_eval>, true, patch_make_tables, patch_decode_rows,
     patch_decode_texels},
    gm_row(),
    field_row(ModelId::car),
    {ModelId::ptm, eval_cpu<PtmParams, ptm_eval>, false, nullptr, nullptr, nullptr,
     begin_state<PtmParams, PtmState, ptm_begin>,
     decode_by_rows<decode_with_state<PtmParams, PtmState, ptm_texel>>},
    {ModelId::plm, eval_cpu<PlmParams, plm_eval>, false, nullptr, nullptr, nullptr,
     begin_state<PlmParams, PlmState, plm_begin>,
     decode_by_rows<decode_with_state<PlmParams, PlmState, plm_texel>>},
    {ModelId::pcarf, eval_cpu<PcarfParams, pcarf_eval>, false, nullptr, nullptr, nullptr, pcarf_begin_values,
     decode_by_rows<pcarf_decode_values>},
    {ModelId::pca, eval_cpu<PcaParams, pca_eval>, false, nullptr, nullptr, nullptr, pca_begin_values,
     decode_by_rows<pca_decode_values>},
    {ModelId::lpca, eval_cpu<LpcaParams, lpca_eval>, false, nullptr, nullptr, nullptr, lpca_begin_values,
     decode_by_rows<lpca_decode_values>},
    field_row(ModelId::gmrf),
    field_row(ModelId::car3d),
};
static_assert(std::size(kDecoders) == kModelCount);

}  // namespace

const DecoderModel& decoder_model(ModelId id) {
  return *std::find_if(std::begin(kDecoders), std::end(kDecoders),
                       [&](const DecoderModel& m) { return m.id == id; });
}

BtfcWords words_of(const LoadedItem& item) {
  return {{item.words[0].data(), item.words[1].data(), item.words[2].data(), item.words[3].data()}};
}

}  // namespace btfc
