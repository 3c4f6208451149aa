// Models car, gmrf and car3d: images or a BTF -> subspaces, range map, factors, levels -> chunks.
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kFieldFitOptions;
template <ModelId kModel>
Result<FitResult> field_fit(const FitInput& input, const FitSettings& settings);
extern template Result<FitResult> field_fit<ModelId::car>(const FitInput&, const FitSettings&);
extern template Result<FitResult> field_fit<ModelId::gmrf>(const FitInput&, const FitSettings&);
extern template Result<FitResult> field_fit<ModelId::car3d>(const FitInput&, const FitSettings&);

}  // namespace btfc
