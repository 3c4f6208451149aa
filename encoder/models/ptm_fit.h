// Model ptm, encoder: biquadratic polynomials of the light by least squares (survey, section 4.1.1).
#pragma once
#include "encoder/dataset/direction.h"
#include "encoder/linear/matrix.h"
#include "encoder/model_table.h"

namespace btfc {

extern const std::span<const OptionSpec> kPtmFitOptions;

// The matrix that turns values under these lights into the six coefficients of eq. 2: the pseudo-inverse of
// the lights' terms by SVD. Where lights determine fewer than six (too few, on a line, on a ring), the
// solution of least norm; singular values below 1e-4 of the largest count as none. weights: how much each
// light's squared error counts; none: all alike.
struct PtmInverse {
  MatrixD terms;    // lights x 6
  MatrixD inverse;  // 6 x lights
  std::uint32_t rank = 0;
};
PtmInverse ptm_inverse(const std::vector<Vector3>& lights, std::span<const double> weights = {});

// Needs FitInput::dataset. Reports the least number of coefficients that a view's lights determine, and the
// error before the coefficients are coded.
Result<FitResult> ptm_fit(const FitInput& input, const FitSettings& settings);

}  // namespace btfc
