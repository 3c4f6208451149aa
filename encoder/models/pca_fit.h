// Model pca, encoder: PCA of all images of a BTF (survey, section 4.2.2).
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kPcaFitOptions;

// Needs FitInput::dataset. Reports the rank and the share of the energy left out.
Result<FitResult> pca_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
