// Sums of squared 16-bit differences with Highway: one binary, the best instruction set found at run time. A
// lane is a position of the sample, so there is no sum across lanes and no remainder of a row.
#include "encoder/models/patch_distance.h"

#include <algorithm>

#include "encoder/models/patch_search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/patch_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Two vectors of positions may reach this far beyond the last one.
static_assert(2 * HWY_MAX_BYTES / 4 <= PairPlanes::kPaddingTexels);

// Pairs between two looks at whether a group of positions can be given up.
constexpr std::uint32_t kStepsALook = 96;

#if HWY_TARGET == HWY_SCALAR

void zone_distances_target(const PairPlanes& sample, const PairTemplate& zone, std::uint32_t x,
                           std::uint32_t y, std::uint32_t count, std::uint64_t limit,
                           std::uint64_t* distances) {
  for (std::uint32_t p = 0; p < count; ++p) {
    std::uint64_t sum = 0;
    const std::int16_t* shown = zone.pairs.data();
    for (const PairTemplate::Run& run : zone.runs) {
      const std::int16_t* patch = sample.at(run.channel, x + p + run.u, y + run.v);
      for (std::uint32_t t = 0; t < run.texels; ++t) {
        const std::int32_t difference = patch[2 * t] - shown[t];
        sum += static_cast<std::uint64_t>(difference * difference);
      }
      if (sum > limit) break;
      shown += run.texels + run.texels % 2;
    }
    distances[p] = sum;
  }
}

#else

// Two vectors of positions at a time: each template pair is loaded once for both.
void zone_distances_target(const PairPlanes& sample, const PairTemplate& zone, std::uint32_t x,
                           std::uint32_t y, std::uint32_t count, std::uint64_t limit,
                           std::uint64_t* distances) {
  const hn::ScalableTag<std::int16_t> d16;
  const hn::ScalableTag<std::int32_t> d32;
  const std::size_t lanes = hn::Lanes(d32);
  const std::uint32_t batch = std::min(kStepsALook, zone.steps_a_sum);
  HWY_ALIGN std::int32_t sums[2 * HWY_MAX_BYTES / 4];
  const auto first_only = hn::BitCast(d16, hn::Set(d32, 0xffff));

  for (std::uint32_t p = 0; p < count; p += static_cast<std::uint32_t>(2 * lanes)) {
    std::uint64_t total[2 * HWY_MAX_BYTES / 4] = {};
    const std::uint32_t valid = std::min<std::uint32_t>(count - p, static_cast<std::uint32_t>(2 * lanes));
    auto a0 = hn::Zero(d32), a1 = hn::Zero(d32), b0 = hn::Zero(d32), b1 = hn::Zero(d32);
    std::uint32_t left = batch;
    bool given_up = false;
    // Moves the 32-bit sums into the 64-bit totals; true where no position can stay within the limit.
    const auto look = [&] {
      hn::Store(hn::RearrangeToOddPlusEven(a0, a1), d32, sums);
      hn::Store(hn::RearrangeToOddPlusEven(b0, b1), d32, sums + lanes);
      a0 = a1 = b0 = b1 = hn::Zero(d32);
      left = batch;
      std::uint64_t least = UINT64_MAX;
      for (std::uint32_t i = 0; i < valid; ++i) {
        total[i] += static_cast<std::uint32_t>(sums[i]);
        least = std::min(least, total[i]);
      }
      return least > limit;
    };
    const std::int16_t* shown = zone.pairs.data();
    for (const PairTemplate::Run& run : zone.runs) {
      const std::int16_t* patch = sample.at(run.channel, x + p + run.u, y + run.v);
      for (std::uint32_t t = 0; t < run.texels; t += 2, shown += 2) {
        std::int32_t pair;
        __builtin_memcpy(&pair, shown, 4);
        const auto wanted = hn::BitCast(d16, hn::Set(d32, pair));
        auto a = hn::Sub(hn::LoadU(d16, patch + 2 * t), wanted);
        auto b = hn::Sub(hn::LoadU(d16, patch + 2 * t + 2 * lanes), wanted);
        if (t + 1 == run.texels) {
          a = hn::And(a, first_only);
          b = hn::And(b, first_only);
        }
        a0 = hn::ReorderWidenMulAccumulate(d32, a, a, a0, a1);
        b0 = hn::ReorderWidenMulAccumulate(d32, b, b, b0, b1);
        if (--left == 0 && look()) {
          given_up = true;
          break;
        }
      }
      if (given_up) break;
    }
    if (!given_up) look();
    std::copy_n(total, valid, distances + p);
  }
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(zone_distances_target);

PairPlanes::PairPlanes(const MatchImage& sample)
    : width_(sample.width),
      height_(sample.height),
      channels_(sample.channels),
      stride_(sample.width + kPaddingTexels) {
  const auto [least, most] = std::minmax_element(sample.values.begin(), sample.values.end());
  range_ = static_cast<std::uint32_t>(*most - *least);
  pairs_.resize(2 * stride_ * height_ * channels_);
  for (std::uint32_t c = 0; c < channels_; ++c) {
    for (std::uint32_t y = 0; y < height_; ++y) {
      std::int16_t* row = pairs_.data() + 2 * (std::size_t{c} * height_ + y) * stride_;
      for (std::uint32_t x = 0; x < sample.width; ++x) {
        row[2 * x] = sample.row(x, y)[c];
        if (x > 0) row[2 * x - 1] = row[2 * x];
      }
    }
  }
}

PairTemplate pair_template(const BoundaryZone& zone, const PairPlanes& sample) {
  PairTemplate out;
  const std::uint32_t channels = sample.channels();
  const std::int16_t* values = zone.values.data();
  for (const ZoneRun& run : zone.runs) {
    for (std::uint32_t c = 0; c < channels; ++c) {
      out.runs.push_back({run.u, run.v, c, run.length});
      for (std::uint32_t t = 0; t < run.length; ++t)
        out.pairs.push_back(values[std::size_t{t} * channels + c]);
      if (run.length % 2 == 1) out.pairs.push_back(0);
    }
    values += std::size_t{run.length} * channels;
  }
  // What the texture shows lies in the sample's range: blends lie between their ends.
  const std::uint64_t range = std::max(sample.range(), 1u);
  out.steps_a_sum = static_cast<std::uint32_t>((1ull << 31) / (2 * range * range) - 1);
  return out;
}

void zone_distances(const PairPlanes& sample, const PairTemplate& zone, std::uint32_t x, std::uint32_t y,
                    std::uint32_t count, std::uint64_t limit, std::uint64_t* distances) {
  HWY_DYNAMIC_DISPATCH(zone_distances_target)(sample, zone, x, y, count, limit, distances);
}

}  // namespace btfc
#endif
