// The rows of the decoder's table: eval functions over the shared headers.
#include "decoder/model_table.h"

#include <algorithm>
#include <cstring>

#include "decoder/field_values.h"
#include "decoder/gm_values.h"
#include "decoder/patch_rows.h"
#include "decoder/table_values.h"
#include "format/model_table.h"
#include "shaders/models/car.h"
#include "shaders/models/car3d.h"
#include "shaders/models/gm.h"
#include "shaders/models/gmrf.h"
#include "shaders/models/lpca.h"
#include "shaders/models/patch.h"
#include "shaders/models/pca.h"
#include "shaders/models/pcarf.h"
#include "shaders/models/plm.h"
#include "shaders/models/ptm.h"

namespace btfc {
namespace {

vec4 patch_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return patch_eval(words_of(item), params_of<PatchParams>(item, map), query);
}

vec4 gm_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return gm_eval(words_of(item), params_of<GmParams>(item, map), query);
}

vec4 pca_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return pca_eval(words_of(item), params_of<PcaParams>(item, map), query);
}

vec4 ptm_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return ptm_eval(words_of(item), params_of<PtmParams>(item, map), query);
}

vec4 plm_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return plm_eval(words_of(item), params_of<PlmParams>(item, map), query);
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

vec4 pcarf_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return pcarf_eval(words_of(item), params_of<PcarfParams>(item, map), query);
}

vec4 lpca_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return lpca_eval(words_of(item), params_of<LpcaParams>(item, map), query);
}

vec4 car_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return car_eval(words_of(item), params_of<FieldParams>(item, map), query);
}

vec4 gmrf_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return gmrf_eval(words_of(item), params_of<FieldParams>(item, map), query);
}

vec4 car3d_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return car3d_eval(words_of(item), params_of<FieldParams>(item, map), query);
}

// The random fields' row: tiles in a cache.
constexpr DecoderModel field_row(ModelId id, decltype(DecoderModel::eval) eval) {
  DecoderModel row{id, eval, false};
  row.make_cache = field_make_cache;
  row.cached_queries = field_cached_queries;
  row.cached_rect = field_cached_rect;
  row.select = field_select;
  return row;
}

const DecoderModel kDecoders[] = {
    {ModelId::patch, patch_eval_cpu, true, patch_make_tables, patch_decode_rows, patch_decode_texels},
    {ModelId::gm, gm_eval_cpu, false, nullptr, nullptr, nullptr, gm_begin_values, gm_decode_values,
     gm_eval_queries},
    field_row(ModelId::car, car_eval_cpu),
    {ModelId::ptm, ptm_eval_cpu, false, nullptr, nullptr, nullptr,
     begin_state<PtmParams, PtmState, ptm_begin>,
     decode_by_rows<decode_with_state<PtmParams, PtmState, ptm_texel>>},
    {ModelId::plm, plm_eval_cpu, false, nullptr, nullptr, nullptr,
     begin_state<PlmParams, PlmState, plm_begin>,
     decode_by_rows<decode_with_state<PlmParams, PlmState, plm_texel>>},
    {ModelId::pcarf, pcarf_eval_cpu, false, nullptr, nullptr, nullptr, pcarf_begin_values,
     decode_by_rows<pcarf_decode_values>},
    {ModelId::pca, pca_eval_cpu, false, nullptr, nullptr, nullptr, pca_begin_values,
     decode_by_rows<pca_decode_values>},
    {ModelId::lpca, lpca_eval_cpu, false, nullptr, nullptr, nullptr, lpca_begin_values,
     decode_by_rows<lpca_decode_values>},
    field_row(ModelId::gmrf, gmrf_eval_cpu),
    field_row(ModelId::car3d, car3d_eval_cpu),
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
