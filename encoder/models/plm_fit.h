// Model plm, encoder: a Lafortune lobe a view, texel and channel, and polynomials (survey, section 4.1.2).
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kPlmFitOptions;

// Needs FitInput::dataset. Reports the error that the lobes leave over, alone and with polynomials, and how
// many polynomials are kept.
Result<FitResult> plm_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
