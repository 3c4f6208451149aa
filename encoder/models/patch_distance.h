// Squared distances between a boundary zone and many positions of the sample at once, by SIMD.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/models/patch_features.h"

namespace btfc {

struct BoundaryZone;

// The sample S for sums of products with a zone's values T, from which
//   sum (S - T)^2 = sum (S^2 - 2 c S) - 2 sum S (T - c) + sum T^2
// follows exactly, in integers; the first sum comes from a summed table. One plane a channel, four bytes a
// texel, in one of two codings, so that one instruction multiplies several neighbouring texels of one
// position:
//   quads   S at x … x+3 as unsigned bytes, c = 128: values of 8 bits, where the processor has the
//   instruction pairs   S at x, x+1 as signed 16 bits around the middle of S's range, c = 0
// Rows are padded: loads may run past the last position.
class SearchPlanes {
 public:
  // Behind each row, for vectors of up to 256 bytes; not Highway's own constant, which differs between
  // targets.
  static constexpr std::size_t kPaddingTexels = 256;
  explicit SearchPlanes(const MatchImage& sample, bool allow_quads = true);

  bool quads() const { return quads_; }
  std::uint32_t texels_a_word() const { return quads_ ? 4 : 2; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  std::uint32_t channels() const { return channels_; }
  // A matching value as the zone's words have it (T - c), for a value that the sample's range holds.
  std::int32_t centred(std::int16_t value) const { return value - centre_; }
  // Words whose products a signed 32-bit sum takes without overflow.
  std::uint32_t words_a_sum() const { return words_a_sum_; }
  const std::uint8_t* at(std::uint32_t channel, std::uint32_t x, std::uint32_t y) const {
    return words_.data() + 4 * ((std::size_t{channel} * height_ + y) * stride_ + x);
  }
  std::size_t row_stride() const { return 4 * stride_; }  // bytes
  std::size_t channel_stride() const { return row_stride() * height_; }
  // Row y of the summed table, width + 1 entries: sums over [0, x) x [0, y) and all channels of S^2 - 2 c S.
  const std::int64_t* sums(std::uint32_t y) const { return sums_.data() + std::size_t{y} * (width_ + 1); }

 private:
  bool quads_;
  std::uint32_t width_, height_, channels_, words_a_sum_;
  std::int32_t centre_;
  std::size_t stride_;  // texels
  std::vector<std::uint8_t> words_;
  std::vector<std::int64_t> sums_;
};

// A zone's values for that purpose: rectangles of equal rows, in each the words row by row, channel by
// channel.
struct ZoneTemplate {
  struct Block {
    std::uint32_t u, v, width, rows;  // texels, relative to the patch
    std::uint32_t row_words;          // of one channel
    std::size_t first_word;
    std::uint64_t squares;  // sum of T^2 (of centred T in pairs)
  };
  std::vector<Block> blocks;
  std::vector<std::int32_t> words;
};

ZoneTemplate zone_template(const BoundaryZone& zone, const SearchPlanes& sample);

// distances[p] = the exact sum of squared differences at position (x + p, y), for p = 0 … count-1; for
// positions whose sum exceeds limit, any number above limit, since groups of positions are given up early.
void zone_distances(const SearchPlanes& sample, const ZoneTemplate& zone, std::uint32_t x, std::uint32_t y,
                    std::uint32_t count, std::uint64_t limit, std::uint64_t* distances);

}  // namespace btfc
