// How far a synthesised texture is from its material, beside how far the material is from itself.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

// A stochastic model is not asked to come nearer to its reference than another sample of the material does:
// to quote is their ratio. A copy of the reference shares texels with its crops, and does better: 3/4
// of the ceiling where there are four, as four of the sixteen pairs are equal.
struct AgainstCeiling {
  double value = 0;    // the mean over the candidate's crops against the reference's
  double ceiling = 0;  // the mean over pairs of crops of the reference

  // For distances: 1 as near as the material to itself, above 1 further. Not finite where the ceiling is 0.
  double ratio() const { return value / ceiling; }
};

// Values are display-coded, as in ImageMetrics; all but the marginals are of luma.
struct TextureDistances {
  std::uint32_t crop = 0;                // texels a side of all crops
  AgainstCeiling marginals;              // mean over axes of the next
  std::vector<AgainstCeiling> marginal;  // marginal_distances along the axes of the reference's crops
  AgainstCeiling spectrum;               // spectrum_distance, blocks of spectrum_block
  AgainstCeiling autocorrelation;        // autocorrelation_distance
  AgainstCeiling stsim2;                 // a similarity: 1 is best
  // Of 1 - stsim2, so that it says what the distances' ratios say.
  double stsim2_ratio() const { return (1 - stsim2.value) / (1 - stsim2.ceiling); }
};

inline constexpr std::uint32_t kLeastTextureCrop = 16, kMostTextureCrop = 512;

// Crops are squares of one size: the largest power of two, at most kMostTextureCrop, that fits into half of
// the reference, cut across its longer side, and into the candidate. Each image is cut into two parts each
// way where they hold a crop, else one; a crop lies in the middle of each part. So there are four or two
// crops of the reference, and one to four of the candidate. Refused: crops below kLeastTextureCrop, different
// numbers of channels. Seconds for the largest crops. Thread-safe.
Result<TextureDistances> texture_distances(const Image& reference, const Image& candidate);

// A reference that several candidates are held against: what is reckoned of it alone is kept, for the largest
// crops that it allows. Immutable; thread-safe.
class TextureReference {
 public:
  explicit TextureReference(Image image);
  const Image& image() const { return image_; }
  // As texture_distances.
  Result<TextureDistances> distances(const Image& candidate) const;

 private:
  struct Crops;
  friend Result<TextureDistances> texture_distances(const Image&, const Image&);
  static Result<std::uint32_t> crop_for(const Image& reference, const Image& candidate);
  static Crops crops_for(const Image& reference, std::uint32_t side);
  static TextureDistances distances(const Crops& own, const Image& candidate);

  Image image_;
  std::shared_ptr<const Crops> largest_;  // null where none fits
};

}  // namespace btfc
