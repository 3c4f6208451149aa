// Gradient descent by Adam (Kingma, Ba 2015) on the numbers of a mixture, with rounding in the loop.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "encoder/models/gm_gradient.h"
#include "format/models/gm_field.h"
#include "format/models/gm_mixture.h"

namespace btfc {

// All numbers in single precision, by the rows of a mixture with four channels and shear; room for `stride`
// components.
struct GmMaster {
  std::uint32_t components = 0, stride = 0;
  std::vector<float> numbers, first, second;  // [row * stride + m]; moments of the gradient
  float* row(std::uint32_t r) { return numbers.data() + std::size_t{r} * stride; }
  const float* row(std::uint32_t r) const { return numbers.data() + std::size_t{r} * stride; }
};

// Ends of what a row may hold.
struct GmLimits {
  std::array<float, kGmFieldRows> low{}, high{};
};

struct GmAdamOptions {
  std::array<float, kGmFieldRows> rate{};  // a step; of mu and shear in spreads, of log2 sigma as it is
  float scale = 1;                         // on all rates
  std::uint64_t step = 1;                  // 1, 2 …: takes the bias off the moments
  float inverse_samples = 1;               // the gradient is divided by the samples
  // Rounding that the field sees: of a master's rows, and none for f32.
  Precision precision = Precision::f32;
  std::array<RowScale, kGmFieldRows> scales{};
};

// One step for components begin … end-1 (multiples of kGmPad): the gradients are added up in order, then
// cleared; the field's numbers of these components follow.
void gm_adam_step(GmMaster& master, std::span<GmSums> sums, const GmLimits& limits,
                  const GmAdamOptions& options, std::size_t begin, std::size_t end, GmField& field);

// The field of all components as a decoder will see it.
void gm_master_field(const GmMaster& master, const GmAdamOptions& options, GmField& field);
GmMixture gm_master_mixture(const GmMaster& master, const GmShape& shape);

}  // namespace btfc
