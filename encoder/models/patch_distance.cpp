// Sums of squared 16-bit differences with Highway: one binary, the best instruction set found at run time.
#include "encoder/models/patch_distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/patch_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A 32-bit lane takes pairs of squares of at most 4095^2, so 63 steps fit.
constexpr std::size_t kStepsPerLane = 63;
static_assert(2ull * kMaxMatchDifference * kMaxMatchDifference * kStepsPerLane < (1ull << 31));

#if HWY_TARGET == HWY_SCALAR

std::uint64_t row_distance(const std::int16_t* a, const std::int16_t* b, std::size_t count) {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t difference = a[i] - b[i];
    total += static_cast<std::uint64_t>(difference * difference);
  }
  return total;
}

#else

std::uint64_t row_distance(const std::int16_t* a, const std::int16_t* b, std::size_t count) {
  const hn::ScalableTag<std::int16_t> d16;
  const hn::ScalableTag<std::int32_t> d32;
  const hn::ScalableTag<std::uint64_t> d64;
  const std::size_t lanes = hn::Lanes(d16);
  auto total = hn::Zero(d64);
  std::size_t i = 0;
  while (i + lanes <= count) {
    auto sum0 = hn::Zero(d32), sum1 = hn::Zero(d32);
    for (std::size_t step = 0; step < kStepsPerLane && i + lanes <= count; ++step, i += lanes) {
      const auto difference = hn::Sub(hn::LoadU(d16, a + i), hn::LoadU(d16, b + i));
      sum0 = hn::ReorderWidenMulAccumulate(d32, difference, difference, sum0, sum1);
    }
    // The sums are below 2^32 and not negative: widen both halves of each 64 bits.
    const auto both = hn::BitCast(d64, hn::Add(sum0, sum1));
    total = hn::Add(total, hn::Add(hn::And(both, hn::Set(d64, 0xffffffffu)), hn::ShiftRight<32>(both)));
  }
  std::uint64_t rest = 0;
  for (; i < count; ++i) {
    const std::int32_t difference = a[i] - b[i];
    rest += static_cast<std::uint64_t>(difference * difference);
  }
  return hn::GetLane(hn::SumOfLanes(d64, total)) + rest;
}

#endif

std::uint64_t zone_distance_target(const MatchImage& sample, PatchPosition at, const BoundaryZone& zone,
                                   std::uint64_t limit) {
  const std::int16_t* shown = zone.values.data();
  std::uint64_t distance = 0;
  for (const ZoneRun& run : zone.runs) {
    const std::size_t count = std::size_t{run.length} * sample.channels;
    distance += row_distance(shown, sample.row(at.x + run.u, at.y + run.v), count);
    if (distance > limit) break;
    shown += count;
  }
  return distance;
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(zone_distance_target);

std::uint64_t zone_distance(const MatchImage& sample, PatchPosition at, const BoundaryZone& zone,
                            std::uint64_t limit) {
  return HWY_DYNAMIC_DISPATCH(zone_distance_target)(sample, at, zone, limit);
}

}  // namespace btfc
#endif
