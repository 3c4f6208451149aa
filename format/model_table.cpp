// The rows of the model table.
#include "format/model_table.h"

#include "format/models/field_payload.h"
#include "format/models/gm_payload.h"
#include "format/models/lpca_payload.h"
#include "format/models/patch_payload.h"
#include "format/models/pca_payload.h"
#include "format/models/pcarf_payload.h"
#include "format/models/plm_payload.h"
#include "format/models/ptm_payload.h"

namespace btfc {
namespace {

const ModelFormat kModels[] = {
    {ModelId::patch, "patch", "sample + patch coordinates + minimum error boundary cuts",
     "spec/models/patch.md", kPatchChunkTypes, kPatchSizeOptions, patch_describe, patch_layout, patch_load},
    {ModelId::gm, "gm", "Gaussian mixture over texel and directions, and the mean BRDF", "spec/models/gm.md",
     kGmChunkTypes, kGmSizeOptions, gm_describe, gm_layout, gm_load, gm_reduced},
    {ModelId::car, "car",
     "causal autoregressive fields of subspaces, a range map: unbounded, any texel on its own",
     "spec/models/car.md", kFieldChunkTypes, kFieldSizeOptions, field_describe<ModelId::car>, field_layout,
     field_load},
    {ModelId::ptm, "ptm", "polynomial texture maps: a biquadratic of the light a view and texel",
     "spec/models/ptm.md", kPtmChunkTypes, kPtmSizeOptions, ptm_describe, ptm_layout, ptm_load},
    {ModelId::plm, "plm", "a Lafortune lobe a view and texel, a polynomial a pair of directions",
     "spec/models/plm.md", kPlmChunkTypes, kPlmSizeOptions, plm_describe, plm_layout, plm_load, plm_reduced},
    {ModelId::pcarf, "pcarf",
     "PCA of each view's images: a mean image and eigenimages a view, weights a pair", "spec/models/pcarf.md",
     kWeightedChunkTypes, kPcarfSizeOptions, pcarf_describe, pcarf_layout, pcarf_load,
     weighted_reduced<kPcarfModel>},
    {ModelId::pca, "pca", "PCA of the whole BTF: mean image, eigenimages, weights of each pair of directions",
     "spec/models/pca.md", kWeightedChunkTypes, kPcaSizeOptions, pca_describe, pca_layout, pca_load,
     weighted_reduced<kPcaModel>},
    {ModelId::lpca, "lpca", "local PCA: clusters of texels, each with a mean and eigenvectors over the pairs",
     "spec/models/lpca.md", kLpcaChunkTypes, kLpcaSizeOptions, lpca_describe, lpca_layout, lpca_load,
     lpca_reduced},
    {ModelId::gmrf, "gmrf", "Gaussian Markov random fields of subspaces on tori, a range map",
     "spec/models/gmrf.md", kFieldChunkTypes, kFieldSizeOptions, field_describe<ModelId::gmrf>, field_layout,
     field_load},
    {ModelId::car3d, "car3d", "as car, one field of all channels a level in place of one a factor",
     "spec/models/car3d.md", kFieldChunkTypes, kFieldSizeOptions, field_describe<ModelId::car3d>,
     field_layout, field_load},
};
static_assert(std::size(kModels) == kModelCount);

}  // namespace

std::uint32_t level_count(const Layout& layout) {
  std::uint32_t most = 0;
  for (const ChunkSpec& chunk : layout.chunks) most = std::max<std::uint32_t>(most, chunk.key.level);
  return most + 1;
}

std::uint64_t payload_bytes(const Layout& layout, std::uint32_t levels) {
  std::uint64_t bytes = 0;
  for (const ChunkSpec& chunk : layout.chunks) {
    const bool read = levels == 0 || chunk.key.level < levels;
    if (read && (chunk.key.flags & kPayload) != 0) bytes += chunk.raw_bytes;
  }
  return bytes;
}

Result<std::optional<TexelCost>> texel_cost(const Head& head, ByteView parm, const Knobs& knobs) {
  const ModelFormat& model = *find_model(head.model);
  Result<Bytes> reduced = Bytes(parm.begin(), parm.end());
  if (model.reduced != nullptr) reduced = model.reduced(head, parm, knobs);
  if (!reduced) return reduced.error();
  const Result<Layout> layout = model.layout(head, *reduced);
  if (!layout) return layout.error();
  return layout->cost;
}

std::span<const ModelFormat> models() { return kModels; }

const ModelFormat* find_model(ModelId id) {
  for (const ModelFormat& model : kModels) {
    if (model.id == id) return &model;
  }
  return nullptr;
}

const ModelFormat* find_model(std::string_view name) {
  for (const ModelFormat& model : kModels) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

}  // namespace btfc
