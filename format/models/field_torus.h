// Model gmrf: a level's field on a torus, the noise under the square root of the model's spectrum.
#pragma once
#include <cstdint>
#include <span>

#include "format/models/field_band.h"
#include "format/result.h"

namespace btfc {

// 1 - 2 sum a_s cos(2 pi (dx j + dy i) / n) at (j, i): sigma^2 over it is the power spectrum. n x n, rows.
void field_torus_denominator(std::span<const FieldOffset> offsets, const float* coefficients,
                             std::uint32_t side, std::span<double> out);

// Of one factor of one subspace: side x side values in rows. Refused under FD6: a spectrum that is not
// positive, or above 2^24 times the noise's.
Result<Done> field_torus(const FieldBand& band, std::uint32_t subspace, std::uint32_t factor,
                         std::uint32_t side, float* out);

}  // namespace btfc
