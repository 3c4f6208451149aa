// The rows of the encoder's table.
#include "encoder/model_table.h"

#include <algorithm>

#include "encoder/models/field_fit.h"
#include "encoder/models/gm_fit.h"
#include "encoder/models/lpca_fit.h"
#include "encoder/models/patch_fit.h"
#include "encoder/models/patch_joins.h"
#include "encoder/models/pca_fit.h"
#include "encoder/models/pcarf_fit.h"
#include "encoder/models/plm_fit.h"
#include "encoder/models/ptm_exchange.h"
#include "encoder/models/ptm_fit.h"

namespace btfc {
namespace {

const FileExchange kPtmFiles = {"ptm", ptm_import, ptm_export};

// The random fields. An image has one subspace, whatever the clusters.
constexpr const char* kFieldLadder[] = {"", "--clusters 4", "--clusters 16", "--order 24", "--knots 0"};
template <ModelId id>
Fitter field_row() {
  Fitter row{.id = id,
             .input = InputKind::either,
             .options = kFieldFitOptions,
             .fit = field_fit<id>,
             .reconstructs = true};
  row.keeps_texels = false;
  row.ladder = kFieldLadder;
  return row;
}

// The ladders. Of patch: textures of about 512 x 512. Of pca, pcarf and lpca a fit of rank k shows every rank
// below it.
constexpr const char* kPatchLadder[] = {
    "--sample auto --sample-size 128x128 --wb 48 --k 13",
    "--sample auto --sample-size 64x64 --wb 24 --k 26",
    "--sample auto --sample-size 256x256 --wb 64 --k 9",
    "--sample auto --sample-size 128x128 --wb 48 --k 13 --blend liang",
    "--sample auto --sample-size 128x128 --wb 32 --k 19",
    "--sample auto --sample-size 128x128 --wb 64 --k 9",
    "--sample auto --sample-size 128x128 --wb 48 --k 13 --pack rgba8",
};
constexpr const char* kGmLadder[] = {
    "--iterations 2000 --components 256",
    "--iterations 2000 --components 1024",
    "--iterations 2000 --components 64",
    "--iterations 2000 --components 256 --gates 8",
    "--iterations 2000 --components 32 --mean-rank 2",
    "--iterations 1000 --components 2400",
};
constexpr const char* kPtmLadder[] = {"--precision u8", "--precision f16", "--precision f32"};
constexpr const char* kPlmLadder[] = {"--precision u8", "--precision u8 --clusters 64", "--precision f16"};
constexpr const char* kPcarfLadder[] = {"--precision u8 --rank 12", "--precision f16 --rank 12"};
constexpr const char* kPcaLadder[] = {"--precision u8 --rank 40", "--precision f16 --rank 40"};
constexpr const char* kLpcaLadder[] = {
    "--precision u8 --clusters 8 --rank 16", "--precision u8 --clusters 1 --rank 40",
    "--precision u8 --clusters 2 --rank 32", "--precision u8 --clusters 32 --rank 12",
    "--precision u8 --clusters 4 --rank 24", "--precision f16 --clusters 8 --rank 16",
};

const Fitter kFitters[] = {
    {.id = ModelId::patch,
     .input = InputKind::images,
     .options = kPatchFitOptions,
     .fit = patch_fit,
     .joins = patch_file_joins,
     .keeps_texels = false,
     .ladder = kPatchLadder},
    {.id = ModelId::gm,
     .input = InputKind::dataset,
     .options = kGmFitOptions,
     .fit = gm_fit,
     .ladder = kGmLadder,
     .dial = "components"},
    field_row<ModelId::car>(),
    {.id = ModelId::ptm,
     .input = InputKind::dataset,
     .options = kPtmFitOptions,
     .fit = ptm_fit,
     .exchange = &kPtmFiles,
     .views_apart = true,
     .ladder = kPtmLadder},
    {.id = ModelId::plm,
     .input = InputKind::dataset,
     .options = kPlmFitOptions,
     .fit = plm_fit,
     .views_apart = true,
     .ladder = kPlmLadder},
    {.id = ModelId::pcarf,
     .input = InputKind::dataset,
     .options = kPcarfFitOptions,
     .fit = pcarf_fit,
     .views_apart = true,
     .ladder = kPcarfLadder,
     .dial = "rank"},
    {.id = ModelId::pca,
     .input = InputKind::dataset,
     .options = kPcaFitOptions,
     .fit = pca_fit,
     .ladder = kPcaLadder,
     .dial = "rank"},
    {.id = ModelId::lpca,
     .input = InputKind::dataset,
     .options = kLpcaFitOptions,
     .fit = lpca_fit,
     .ladder = kLpcaLadder,
     .dial = "rank"},
    field_row<ModelId::gmrf>(),
    field_row<ModelId::car3d>(),
};
static_assert(std::size(kFitters) == kModelCount);

}  // namespace

const Fitter& fitter(ModelId id) {
  return *std::find_if(std::begin(kFitters), std::end(kFitters), [&](const Fitter& f) { return f.id == id; });
}

}  // namespace btfc
