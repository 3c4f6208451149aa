// The rows of the decoder's table: eval functions over the shared headers.
#include "decoder/model_table.h"

#include <algorithm>

#include "decoder/patch_rows.h"
#include "decoder/table_values.h"
#include "format/model_table.h"
#include "shaders/models/lpca.h"
#include "shaders/models/patch.h"
#include "shaders/models/pca.h"
#include "shaders/models/pcarf.h"

namespace btfc {
namespace {

vec4 patch_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return patch_eval(words_of(item), params_of<PatchParams>(item, map), query);
}

vec4 pca_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return pca_eval(words_of(item), params_of<PcaParams>(item, map), query);
}

vec4 pcarf_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return pcarf_eval(words_of(item), params_of<PcarfParams>(item, map), query);
}

vec4 lpca_eval_cpu(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  return lpca_eval(words_of(item), params_of<LpcaParams>(item, map), query);
}

const DecoderModel kDecoders[] = {
    {ModelId::patch, patch_eval_cpu, true, patch_make_tables, patch_decode_rows, patch_decode_texels},
    {ModelId::pcarf, pcarf_eval_cpu, false, nullptr, nullptr, nullptr, pcarf_begin_values,
     pcarf_decode_values},
    {ModelId::pca, pca_eval_cpu, false, nullptr, nullptr, nullptr, pca_begin_values, pca_decode_values},
    {ModelId::lpca, lpca_eval_cpu, false, nullptr, nullptr, nullptr, lpca_begin_values, lpca_decode_values},
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
