// Adam with Highway; a lane is a component.
#include "encoder/models/gm_adam.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/gm_adam.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/models/gm_kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

constexpr float kBeta1 = 0.9f, kBeta2 = 0.999f, kEpsilon = 1e-10f;

// As rounded() in vectors, but for ties; f16 is done apart.
HWY_INLINE GmVec rounded_u8(GmLanes d, GmVec v, const RowScale& scale) {
  const GmVec offset = hn::Set(d, scale.offset);
  if (!(scale.step > 0)) return offset;
  const GmVec element = hn::Mul(hn::Sub(v, offset), hn::Set(d, 1.0f / scale.step));
  const GmVec code = hn::Round(hn::Min(hn::Max(element, hn::Zero(d)), hn::Set(d, 255.0f)));
  return hn::Add(offset, hn::Mul(code, hn::Set(d, scale.step)));
}

void to_field(const GmMaster& master, const GmAdamOptions& options, std::size_t begin, std::size_t end,
              GmField& field) {
  const GmLanes d;
  for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
    const bool spread = r >= kGmSpreadRow && r < kGmHeightRow;
    for (std::size_t m = begin; m < end; m += hn::Lanes(d)) {
      GmVec v = hn::LoadU(d, master.row(r) + m);
      if (options.precision == Precision::u8) v = rounded_u8(d, v, options.scales[r]);
      if (options.precision == Precision::f16) {
        HWY_ALIGN float lanes[kGmPad];
        hn::Store(v, d, lanes);
        for (float& lane : lanes) lane = rounded(lane, Precision::f16, {});
        v = hn::Load(d, lanes);
      }
      if (spread) v = hn::Mul(hn::Set(d, 0.72134752f), gm_exp2(d, hn::Mul(v, hn::Set(d, -2.0f))));
      hn::StoreU(v, d, field.row(r) + m);
    }
  }
  for (std::size_t m = std::max<std::size_t>(begin, master.components); m < end; ++m) {
    field.row(GM_HEIGHT)[m] = GM_NEVER;
  }
}

void step_target(GmMaster& master, std::span<GmSums> sums, const GmLimits& limits,
                 const GmAdamOptions& options, std::size_t begin, std::size_t end, GmField& field) {
  const GmLanes d;
  float power1 = 1, power2 = 1;
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(options.step, 20000); ++i) {
    power1 *= kBeta1;
    power2 *= kBeta2;
  }
  const GmVec unbias1 = hn::Set(d, 1 / (1 - power1)), unbias2 = hn::Set(d, 1 / (1 - power2));
  for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
    const GmVec rate = hn::Set(d, options.rate[r] * options.scale);
    // mu and the shears move by parts of the spread that they are measured against.
    const bool in_spreads = r < kGmSpreadRow || r >= GM_SHEAR;
    const std::uint32_t spread = r < kGmSpreadRow ? r + kGmSpreadRow : kGmSpreadRow;
    for (std::size_t m = begin; m < end; m += hn::Lanes(d)) {
      const std::size_t at = r * std::size_t{master.stride} + m;
      GmVec g = hn::Zero(d);
      for (GmSums& s : sums) {
        g = hn::Add(g, hn::LoadU(d, s.gradient.data() + at));
        hn::StoreU(hn::Zero(d), d, s.gradient.data() + at);
      }
      g = hn::Mul(g, hn::Set(d, options.inverse_samples));
      GmVec unit = hn::Set(d, 1.0f);
      if (in_spreads) {
        GmVec log2_sigma = hn::LoadU(d, master.row(spread) + m);
        if (r >= GM_SHEAR) log2_sigma = hn::Min(log2_sigma, hn::Set(d, 1.0f));  // a wide one is no high one
        unit = gm_exp2(d, log2_sigma);
      }
      g = hn::Mul(g, unit);
      GmVec first = hn::LoadU(d, master.first.data() + at), second = hn::LoadU(d, master.second.data() + at);
      first = hn::MulAdd(hn::Sub(g, first), hn::Set(d, 1 - kBeta1), first);
      second = hn::MulAdd(hn::Sub(hn::Mul(g, g), second), hn::Set(d, 1 - kBeta2), second);
      hn::StoreU(first, d, master.first.data() + at);
      hn::StoreU(second, d, master.second.data() + at);
      const GmVec size = hn::Add(hn::Sqrt(hn::Mul(second, unbias2)), hn::Set(d, kEpsilon));
      const GmVec step = hn::Div(hn::Mul(hn::Mul(first, unbias1), hn::Mul(rate, unit)), size);
      GmVec v = hn::Sub(hn::LoadU(d, master.row(r) + m), step);
      v = hn::Min(hn::Max(v, hn::Set(d, limits.low[r])), hn::Set(d, limits.high[r]));
      hn::StoreU(v, d, master.row(r) + m);
    }
  }
  to_field(master, options, begin, end, field);
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(step_target);
HWY_EXPORT(to_field);

void gm_adam_step(GmMaster& master, std::span<GmSums> sums, const GmLimits& limits,
                  const GmAdamOptions& options, std::size_t begin, std::size_t end, GmField& field) {
  HWY_DYNAMIC_DISPATCH(step_target)(master, sums, limits, options, begin, end, field);
}

void gm_master_field(const GmMaster& master, const GmAdamOptions& options, GmField& field) {
  field.components = master.components;
  field.stride = master.stride;
  field.data.resize(std::size_t{kGmFieldRows} * master.stride);
  HWY_DYNAMIC_DISPATCH(to_field)(master, options, 0, master.stride, field);
}

GmMixture gm_master_mixture(const GmMaster& master, const GmShape& shape) {
  GmMixture out = gm_make_mixture(shape);
  for (std::uint32_t r = 0; r < shape.rows(); ++r) {
    const std::uint32_t from = r >= shape.shear_row() ? GM_SHEAR + (r - shape.shear_row()) : r;
    std::copy_n(master.row(from), shape.components, out.row(r).begin());
  }
  return out;
}

}  // namespace btfc
#endif
