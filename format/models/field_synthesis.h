// The recursion for many subspaces at once, in vectors: bit for bit what field_synthesise_plain<float> gives.
#pragma once
#include <cstdint>
#include <span>

#include "format/models/field_band.h"

namespace btfc {

// out[(k * factors + f) * texels + y * width + x] of subspaces[k]. Noise is made once for all of them.
void field_synthesise(const FieldBand& band, std::span<const std::uint32_t> subspaces,
                      const FieldWindow& window, float* out);

}  // namespace btfc
