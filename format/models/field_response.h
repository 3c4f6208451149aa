// Impulse responses of a level's recursion, and the rule that keeps every valid file from blowing up.
#pragma once
#include <cstdint>
#include <vector>

#include "format/models/field_band.h"
#include "format/result.h"

namespace btfc {

// Of one subspace: for each output and each noise that it may depend on (car: its own; car3d: d x d, outputs
// first) (margin + 1) x (2 margin + 1) numbers: what the noise at a texel adds dy rows below, dx texels to
// the right, dx from -margin. In binary32, in the recursion's order, zero outside: equal everywhere. Refused
// under FD6: responses that do not die away within the margin.
Result<Done> field_responses(const FieldBand& band, std::uint32_t subspace, float* out);

// How a response dies away: ring r holds the sum of |h| where max(dy, |dx|) = r, of all outputs together, for
// a noise of spread 1 in output g. Its margin is band.margin.
struct FieldDecay {
  std::vector<double> rings;
  std::vector<double> energy;  // of each ring the sum of h^2
  double coefficients = 0;     // sum of |a|
  double whole() const;
  // An upper bound on how much of any disturbance of the window's border is left one margin further: what the
  // last four rings hold, times 1 + sum |a|.
  double beyond() const;
};
FieldDecay field_decay(const FieldBand& band, std::uint32_t subspace, std::uint32_t g);

// Rule FD6's limits.
inline constexpr double kMostResponse = 4096, kMostBeyond = 0.5;

}  // namespace btfc
