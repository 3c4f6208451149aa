// Model patch, encoder layer: from images and options to chunks.
#pragma once
#include <span>

#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kPatchFitOptions;

Result<FitResult> patch_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
