// How far a synthesised texture is from its material, beside how far the material is from itself.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

// A stochastic model is not asked to come nearer to its reference than another sample of the material does:
// to quote is value over ceiling. A copy of the reference shares texels with both crops, and may do better.
struct AgainstCeiling {
  double value = 0;    // the mean of candidate against crop A and candidate against crop B
  double ceiling = 0;  // crop B against crop A of the reference
};

// Values are display-coded, as in ImageMetrics; all but the marginals are of luma.
struct TextureDistances {
  std::uint32_t crop = 0;                // texels a side of all crops
  AgainstCeiling marginals;              // mean over axes of the next
  std::vector<AgainstCeiling> marginal;  // marginal_distances along the axes of crops A and B together
  AgainstCeiling spectrum;               // spectrum_distance, blocks of spectrum_block
  AgainstCeiling autocorrelation;        // autocorrelation_distance
  AgainstCeiling stsim2;                 // a similarity: 1 is best
};

inline constexpr std::uint32_t kLeastTextureCrop = 16, kMostTextureCrop = 512;

// Crops are squares of one size: the largest power of two, at most kMostTextureCrop, that fits into half of
// the reference, cut across its longer side, and into the candidate. A lies in the middle of the reference's
// left (or upper) half, B in that of the other one, the candidate's in its middle. Refused: crops below
// kLeastTextureCrop, different numbers of channels. Seconds for the largest crops. Thread-safe.
Result<TextureDistances> texture_distances(const Image& reference, const Image& candidate);

}  // namespace btfc
