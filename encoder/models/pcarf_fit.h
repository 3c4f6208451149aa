// Model pcarf, encoder: PCA of the images of each view (survey, section 4.2.1).
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kPcarfFitOptions;

// Needs FitInput::dataset. Reports the rank and the share of the energy left out.
Result<FitResult> pcarf_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
