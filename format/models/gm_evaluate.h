// Fast evaluation of a mixture, without the mean BRDF: whole images at fixed directions, and batches of
// queries in any order; beside each the plain loop that it is held against.
#pragma once
#include <cstdint>
#include <span>

#include "format/models/gm_slice.h"

namespace btfc {

struct GmQuery {
  float x = 0, y = 0;  // texels
  GmPairInputs directions;
};

struct GmEvaluation {
  std::uint32_t gates = 0;  // K; 0: all
  // Components are left out that together weigh less than this share of the whole: a value is off by less
  // than that times the range of the outputs, beside rounding.
  float error = 1e-5f;
};

// values[(j * xs.size() + i) * channels + c] at (xs[i], ys[j]). On one thread.
void gm_evaluate_image(const GmSlice& slice, std::span<const float> xs, std::span<const float> ys,
                       const GmEvaluation& how, std::span<float> values);

// values[q * channels + c]. Queries are sorted into cells of place and directions, and each cell looks at the
// components that may count within it. On one thread.
void gm_evaluate_batch(const GmField& field, std::span<const GmQuery> queries, const GmEvaluation& how,
                       std::span<float> values);

// One query after another, all components, in doubles: eqs 8-11 as they are printed.
void gm_evaluate_plain(const GmField& field, std::span<const GmQuery> queries, std::uint32_t gates,
                       std::span<float> values);

}  // namespace btfc
