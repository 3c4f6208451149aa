// Squared distances between a boundary zone and many positions of the sample at once, by SIMD.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/models/patch_features.h"

namespace btfc {

struct BoundaryZone;

// The sample for that purpose: one plane a channel, each texel beside its right neighbour, so that one
// multiply-add of 16-bit pairs serves two template texels of one position. Rows are padded: loads may run
// past the last position.
class PairPlanes {
 public:
  // Behind each row, for vectors of up to 256 bytes; not Highway's own constant, which differs between
  // targets.
  static constexpr std::size_t kPaddingTexels = 128;
  explicit PairPlanes(const MatchImage& sample);
  const std::int16_t* at(std::uint32_t channel, std::uint32_t x, std::uint32_t y) const {
    return pairs_.data() + 2 * ((std::size_t{channel} * height_ + y) * stride_ + x);
  }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  std::uint32_t channels() const { return channels_; }
  // Largest difference of two values of the sample.
  std::uint32_t range() const { return range_; }

 private:
  std::uint32_t width_, height_, channels_, range_ = 0;
  std::size_t stride_;  // texels
  std::vector<std::int16_t> pairs_;
};

// The zone's values for that purpose: run by run, channel by channel, in pairs of texels. An odd run's last
// pair has one texel.
struct PairTemplate {
  struct Run {
    std::uint32_t u, v, channel, texels;
  };
  std::vector<Run> runs;
  std::vector<std::int16_t> pairs;
  std::uint32_t steps_a_sum = 1;  // pairs that a signed 32-bit sum takes without overflow
};

PairTemplate pair_template(const BoundaryZone& zone, const PairPlanes& sample);

// distances[p] = the exact sum of squared differences at position (x + p, y), for p = 0 … count-1; for
// positions whose sum exceeds limit, any number above limit, since groups of positions are given up early.
void zone_distances(const PairPlanes& sample, const PairTemplate& zone, std::uint32_t x, std::uint32_t y,
                    std::uint32_t count, std::uint64_t limit, std::uint64_t* distances);

}  // namespace btfc
