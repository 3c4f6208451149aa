// The conditional squared error of a mixture over rectangles of texels times a few pairs, and its gradient.
// Pairs count by their weights.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/models/gm_samples.h"
#include "format/models/gm_field.h"

namespace btfc {

inline constexpr std::uint32_t kGmTile = 8;  // texels a side of the largest rectangle

// A rectangle of at most kGmTile x kGmTile texels, seen under some pairs of one group.
struct GmVisit {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
  const GmPairGroup* group = nullptr;
  std::span<const std::uint32_t> pairs;
};

struct GmGradientOptions {
  float reach = 12;         // culling, powers of two: gm_kernels-inl.h
  std::uint32_t gates = 0;  // K; 0: all
  bool gradient = true;     // or the error alone
  bool statistics = false;  // usage and error of each component too
};

// Sums over samples. gradient is by the rows of a mixture with four channels and shear; spreads by log2
// sigma.
struct GmSums {
  std::vector<float> gradient;      // [row * stride + m]
  std::vector<float> usage, error;  // of a component: sums of gates, of gate times squared error, by weights
  double squared_error = 0;         // over samples and channels, by weights
  std::uint64_t samples = 0;        // texels times pairs
  std::uint64_t listed = 0;         // components looked at, over samples
  void clear(std::size_t stride);
};

// A thread's room for it.
struct GmScratch {
  std::vector<float> floats;
  std::vector<std::uint32_t> numbers;
};

// Adds to sums. Values are cut off at the ends of what can be shown before they are compared, and what is cut
// off is pulled back by the error that is left.
void gm_add_gradient(const GmField& field, const GmSamples& samples, const GmVisit& visit,
                     const GmGradientOptions& options, GmScratch& scratch, GmSums& sums);

// The same by a plain loop over all components, in doubles, with the gradient in doubles: the reference.
struct GmPlainSums {
  std::vector<double> gradient;
  double squared_error = 0;
};
void gm_add_gradient_plain(const GmMixture& mixture, const GmSamples& samples, const GmVisit& visit,
                           GmPlainSums& sums);

}  // namespace btfc
