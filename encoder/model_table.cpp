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

const Fitter kFitters[] = {
    {ModelId::patch, InputKind::images, kPatchFitOptions, patch_fit, patch_file_joins},
    {ModelId::gm, InputKind::dataset, kGmFitOptions, gm_fit, nullptr},
    {ModelId::car, InputKind::either, kFieldFitOptions, field_fit<ModelId::car>, nullptr, nullptr, true},
    {ModelId::ptm, InputKind::dataset, kPtmFitOptions, ptm_fit, nullptr, &kPtmFiles},
    {ModelId::plm, InputKind::dataset, kPlmFitOptions, plm_fit, nullptr},
    {ModelId::pcarf, InputKind::dataset, kPcarfFitOptions, pcarf_fit, nullptr},
    {ModelId::pca, InputKind::dataset, kPcaFitOptions, pca_fit, nullptr},
    {ModelId::lpca, InputKind::dataset, kLpcaFitOptions, lpca_fit, nullptr},
    {ModelId::gmrf, InputKind::either, kFieldFitOptions, field_fit<ModelId::gmrf>, nullptr, nullptr, true},
    {ModelId::car3d, InputKind::either, kFieldFitOptions, field_fit<ModelId::car3d>, nullptr, nullptr, true},
};
static_assert(std::size(kFitters) == kModelCount);

}  // namespace

const Fitter& fitter(ModelId id) {
  return *std::find_if(std::begin(kFitters), std::end(kFitters), [&](const Fitter& f) { return f.id == id; });
}

}  // namespace btfc
