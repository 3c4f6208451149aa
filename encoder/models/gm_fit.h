// Model gm, encoder: a Gaussian mixture of a BTF, by the paper's expectation maximisation or by descent on
// the error of what is decoded (spec/models/gm.md).
#pragma once
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kGmFitOptions;

// Needs FitInput::dataset, of at most 4 channels. Reports the components, the iterations that give the same
// file again, and the PSNR over all samples as the fit sees them.
Result<FitResult> gm_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
