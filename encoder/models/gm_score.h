// How well a mixture shows all samples.
#pragma once
#include "encoder/models/gm_samples.h"
#include "format/models/gm_mixture.h"

namespace btfc {

// Peak 1, over all samples by their pairs' weights, values as the fit sees them and cut off at the ends of
// what can be shown. On the threads of the calling oneTBB arena, which do not change it.
double gm_psnr(const GmSamples& samples, const GmMixture& mixture, std::uint32_t gates);

}  // namespace btfc
