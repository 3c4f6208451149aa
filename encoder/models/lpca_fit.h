// Model lpca, encoder: texels clustered by how well a local PCA of their apparent BRDFs shows them (survey,
// section 4.2.3).
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kLpcaFitOptions;

// Needs FitInput::dataset. Reports clusters, rank, iterations and the error left.
Result<FitResult> lpca_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
