// Culling and gates of a mixture with Highway: a lane is a component. Included once a target.
//
// A box of inputs keeps the components whose highest gate within the box is no more than `reach` (in powers
// of two) below what the best component is sure of everywhere in the box. What is left out then weighs less
// than components * 2^-reach of the whole, at every input of the box.
#if defined(BTFC_GM_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BTFC_GM_KERNELS_INL_H
#undef BTFC_GM_KERNELS_INL_H
#else
#define BTFC_GM_KERNELS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "format/models/gm_field.h"
#include "format/models/gm_slice.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using GmLanes = hn::CappedTag<float, kGmPad>;
using GmVec = hn::Vec<GmLanes>;

// a b + c and c - a b, rounded twice: not all instruction sets have fused products, and what is decoded must
// not tell them apart.
HWY_INLINE GmVec gm_mul_add(GmVec a, GmVec b, GmVec c) { return hn::Add(hn::Mul(a, b), c); }
HWY_INLINE GmVec gm_mul_less(GmVec a, GmVec b, GmVec c) { return hn::Sub(c, hn::Mul(a, b)); }

// A sum of numbers that come kGmPad at a time, as that many partial sums whatever the lanes of a vector, and
// these by halves: every instruction set rounds alike.
constexpr std::size_t kGmParts = kGmPad / hn::MaxLanes(GmLanes());
struct GmSum {
  GmVec part[kGmParts];
};
HWY_INLINE GmSum gm_no_sum(GmLanes d) {
  GmSum sum;
  for (GmVec& part : sum.part) part = hn::Zero(d);
  return sum;
}
HWY_INLINE float gm_total(GmLanes d, GmSum sum) {
  for (std::size_t half = kGmParts / 2; half > 0; half /= 2) {
    for (std::size_t i = 0; i < half; ++i) sum.part[i] = hn::Add(sum.part[i], sum.part[i + half]);
  }
  float lanes[hn::MaxLanes(GmLanes())];
  hn::StoreU(sum.part[0], d, lanes);
  for (std::size_t half = hn::MaxLanes(d) / 2; half > 0; half /= 2) {
    for (std::size_t i = 0; i < half; ++i) lanes[i] += lanes[i + half];
  }
  return lanes[0];
}

// 2^x as btfc_exp2, for x <= 126.
HWY_INLINE GmVec gm_exp2(GmLanes d, GmVec x) {
  const GmVec z = hn::Max(x, hn::Set(d, -126.0f));
  const GmVec whole = hn::Round(z);
  const GmVec f = hn::Sub(z, whole);
  GmVec p = hn::Set(d, 1.535336188319500e-4f);
  p = gm_mul_add(p, f, hn::Set(d, 1.339887440266574e-3f));
  p = gm_mul_add(p, f, hn::Set(d, 9.618437357674640e-3f));
  p = gm_mul_add(p, f, hn::Set(d, 5.550332471162809e-2f));
  p = gm_mul_add(p, f, hn::Set(d, 2.402264791363012e-1f));
  p = gm_mul_add(p, f, hn::Set(d, 6.931472028550421e-1f));
  p = gm_mul_add(p, f, hn::Set(d, 1.0f));
  const hn::RebindToSigned<GmLanes> di;
  const auto exponent = hn::ShiftLeft<23>(hn::ConvertTo(di, whole));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), exponent));
}

// The short way round, |d| <= period / 2.
HWY_INLINE GmVec gm_short(GmLanes d, GmVec x, float period) {
  return gm_mul_less(hn::Round(hn::Mul(x, hn::Set(d, 1.0f / period))), hn::Set(d, period), x);
}

// Takes from a logit's bounds what a distance of up to `half` to either side of |t| >= 0 costs.
HWY_INLINE void gm_bound(GmLanes d, GmVec t, GmVec half, GmVec scale, GmVec& high, GmVec& low) {
  const GmVec near = hn::Max(hn::Sub(t, half), hn::Zero(d)), far = hn::Add(t, half);
  high = gm_mul_less(scale, hn::Mul(near, near), high);
  low = gm_mul_less(scale, hn::Mul(far, far), low);
}

// Moments over a tile of texels of what is known by its sums over columns and over rows; rows of components.
struct GmTileMoments {
  const float *columns, *rows;  // a row a column or row of the tile
  const float* way;             // from the component to the tile's columns, then, `side` rows later, its rows
  std::size_t side, stride;
  float *sum, *first, *second;  // first, second: times the way and its square; x, then y
};
HWY_INLINE void gm_tile_moments(const GmTileMoments& t, std::size_t count, std::size_t width,
                                std::size_t height) {
  const GmLanes d;
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    GmVec sum = hn::Zero(d);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      GmVec first = hn::Zero(d), second = first;
      const std::size_t n = axis == 0 ? width : height;
      for (std::size_t i = 0; i < n; ++i) {
        const GmVec q = hn::LoadU(d, (axis == 0 ? t.columns : t.rows) + i * t.stride + m);
        const GmVec way = hn::LoadU(d, t.way + (axis * t.side + i) * t.stride + m);
        const GmVec weighted = hn::Mul(q, way);
        if (axis == 0) sum = hn::Add(sum, q);
        first = hn::Add(first, weighted);
        second = gm_mul_add(weighted, way, second);
      }
      hn::StoreU(first, d, t.first + axis * t.stride + m);
      hn::StoreU(second, d, t.second + axis * t.stride + m);
    }
    hn::StoreU(sum, d, t.sum + m);
  }
}

// Arrays of components, row by row, as in GmField.
struct GmRows {
  const float* data;
  std::size_t stride, count;
  const float* row(std::size_t r) const { return data + r * stride; }
};

// Draws together in `out`, rows of out_stride, the components whose `upper` reaches `least`, and their
// numbers in index, which may be null; returns how many. Padded to a whole vector with components whose peak,
// row peak_row, is GM_NEVER. out's rows and index have room for kGmPad more than are copied: whole vectors
// are stored, which is faster than stores of a part.
HWY_INLINE std::size_t gm_draw_rows(const float* const* from, std::size_t rows, std::size_t peak_row,
                                    const float* upper, std::size_t count, float least, float* out,
                                    std::size_t out_stride, std::uint32_t* index) {
  const GmLanes d;
  const hn::RebindToUnsigned<GmLanes> du;
  const auto lane = hn::Iota(du, 0);  // slow: not in the loop
  std::size_t kept = 0;
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const auto mask = hn::Ge(hn::LoadU(d, upper + m), hn::Set(d, least));
    const std::size_t some = hn::CountTrue(d, mask);
    if (some == 0) continue;
    for (std::size_t r = 0; r < rows; ++r)
      hn::StoreU(hn::Compress(hn::LoadU(d, from[r] + m), mask), d, out + r * out_stride + kept);
    if (index != nullptr) {
      const auto number = hn::Add(lane, hn::Set(du, static_cast<std::uint32_t>(m)));
      hn::StoreU(hn::Compress(number, hn::RebindMask(du, mask)), du, index + kept);
    }
    kept += some;
  }
  for (std::size_t m = kept; m < (kept + kGmPad - 1) / kGmPad * kGmPad; ++m) {
    for (std::size_t r = 0; r < rows; ++r) out[r * out_stride + m] = 0;
    out[peak_row * out_stride + m] = GM_NEVER;
    if (index != nullptr) index[m] = 0;
  }
  return kept;
}

// How much culling leaves out: by gm_cut, or where error is 0 what lies `reach` powers of two below the best.
struct GmCull {
  float reach = 0, error = 0;
};

// Copies to `out` (rows of out_stride) the components that may count within the box, and their numbers to
// index; returns how many. The copy is padded with components of height GM_NEVER to a whole vector. upper
// and, with an error, lower have room for rows.count floats.
HWY_INLINE std::size_t gm_select_box(const GmField& field, const GmRows& rows, const GmBox& box,
                                     const GmCull& cull, float* upper, float* lower, float* out,
                                     std::size_t out_stride, std::uint32_t* index) {
  const GmLanes d;
  const std::size_t lanes = hn::Lanes(d);
  GmVec sure = hn::Set(d, GM_NEVER);
  for (std::size_t m = 0; m < rows.count; m += lanes) {
    const GmVec hv = hn::LoadU(d, rows.row(GM_SHEAR) + m), hl = hn::LoadU(d, rows.row(GM_SHEAR + 1) + m);
    GmVec high = hn::LoadU(d, rows.row(GM_HEIGHT) + m), low = high;
    for (std::size_t n = 0; n < 2; ++n) {
      GmVec t = hn::Sub(hn::Set(d, n == 0 ? box.x : box.y), hn::LoadU(d, rows.row(n) + m));
      t = gm_mul_less(hv, hn::Set(d, box.middle.slope[n]), t);
      t = gm_mul_less(hl, hn::Set(d, box.middle.slope[2 + n]), t);
      if (field.wraps) t = gm_short(d, t, n == 0 ? field.width : field.height);
      GmVec half = hn::Set(d, n == 0 ? box.half_x : box.half_y);
      half = gm_mul_add(hn::Abs(hv), hn::Set(d, box.half.slope[n]), half);
      half = gm_mul_add(hn::Abs(hl), hn::Set(d, box.half.slope[2 + n]), half);
      const GmVec scale = hn::LoadU(d, rows.row(GM_SCALE + n) + m);
      gm_bound(d, hn::Abs(t), half, scale, high, low);
    }
    for (std::size_t n = 0; n < 4; ++n) {
      const GmVec t = hn::Abs(hn::Sub(hn::Set(d, box.middle.angle[n]), hn::LoadU(d, rows.row(2 + n) + m)));
      const GmVec half = hn::Set(d, box.half.angle[n]);
      const GmVec scale = hn::LoadU(d, rows.row(GM_SCALE + 2 + n) + m);
      gm_bound(d, t, half, scale, high, low);
    }
    hn::StoreU(high, d, upper + m);
    if (cull.error > 0) hn::StoreU(low, d, lower + m);
    sure = hn::Max(sure, low);
  }
  const float least = cull.error > 0 ? gm_cut(lower, upper, rows.count, cull.error)
                                     : hn::GetLane(hn::MaxOfLanes(d, sure)) - cull.reach;
  const float* from[kGmFieldRows];
  for (std::size_t r = 0; r < kGmFieldRows; ++r) from[r] = rows.row(r);
  return gm_draw_rows(from, kGmFieldRows, GM_HEIGHT, upper, rows.count, least, out, out_stride, index);
}

// The same for a rectangle of texels under one pair of directions, and with kGmPairRows rows. index numbers
// the components of `rows`.
HWY_INLINE std::size_t gm_select_pair(const GmField& field, const GmRows& rows, const GmBox& box, float reach,
                                      float* upper, float* base, float* place_x, float* place_y, float* out,
                                      std::size_t out_stride, std::uint32_t* index) {
  const GmLanes d;
  const std::size_t lanes = hn::Lanes(d);
  GmVec sure = hn::Set(d, GM_NEVER);
  for (std::size_t m = 0; m < rows.count; m += lanes) {
    const GmVec hv = hn::LoadU(d, rows.row(GM_SHEAR) + m), hl = hn::LoadU(d, rows.row(GM_SHEAR + 1) + m);
    GmVec high = hn::LoadU(d, rows.row(GM_HEIGHT) + m);
    for (std::size_t n = 0; n < 4; ++n) {
      const GmVec t = hn::Sub(hn::Set(d, box.middle.angle[n]), hn::LoadU(d, rows.row(2 + n) + m));
      high = gm_mul_less(hn::LoadU(d, rows.row(GM_SCALE + 2 + n) + m), hn::Mul(t, t), high);
    }
    hn::StoreU(high, d, base + m);
    GmVec low = high;
    for (std::size_t n = 0; n < 2; ++n) {
      GmVec mu = hn::LoadU(d, rows.row(n) + m);
      mu = gm_mul_add(hv, hn::Set(d, box.middle.slope[n]), mu);
      mu = gm_mul_add(hl, hn::Set(d, box.middle.slope[2 + n]), mu);
      hn::StoreU(mu, d, (n == 0 ? place_x : place_y) + m);
      GmVec t = hn::Sub(hn::Set(d, n == 0 ? box.x : box.y), mu);
      if (field.wraps) t = gm_short(d, t, n == 0 ? field.width : field.height);
      const GmVec half = hn::Set(d, n == 0 ? box.half_x : box.half_y);
      const GmVec scale = hn::LoadU(d, rows.row(GM_SCALE + n) + m);
      gm_bound(d, hn::Abs(t), half, scale, high, low);
    }
    hn::StoreU(high, d, upper + m);
    sure = hn::Max(sure, low);
  }
  const float least = hn::GetLane(hn::MaxOfLanes(d, sure)) - reach;
  const float* from[kGmPairRows] = {base, place_x, place_y, rows.row(GM_SCALE), rows.row(GM_SCALE + 1)};
  for (std::size_t c = 0; c < field.channels; ++c) from[kGmValue + c] = rows.row(GM_OUTPUT + c);
  return gm_draw_rows(from, kGmValue + field.channels, kGmBase, upper, rows.count, least, out, out_stride,
                      index);
}

// Copies to `out`, rows of out_stride, what a slice's components may count for within a rectangle: without
// those that together weigh less than `error` of the whole at each of its places. Returns how many, and pads
// to a whole vector. low, high have room for slice.stride floats.
HWY_INLINE std::size_t gm_select_tile(const GmSlice& slice, const GmBox& box, float error, float* low,
                                      float* high, float* out, std::size_t out_stride) {
  const GmLanes d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t m = 0; m < slice.stride; m += lanes) {
    GmVec most = hn::LoadU(d, slice.row(kGmBase) + m), least = most;
    for (std::size_t n = 0; n < 2; ++n) {
      GmVec t = hn::Sub(hn::Set(d, n == 0 ? box.x : box.y), hn::LoadU(d, slice.row(kGmPlace + n) + m));
      if (slice.wraps) t = gm_short(d, t, n == 0 ? slice.width : slice.height);
      gm_bound(d, hn::Abs(t), hn::Set(d, n == 0 ? box.half_x : box.half_y),
               hn::LoadU(d, slice.row(kGmWidth + n) + m), most, least);
    }
    hn::StoreU(most, d, high + m);
    hn::StoreU(least, d, low + m);
  }
  const float* from[kGmPairRows];
  for (std::size_t r = 0; r < kGmValue + slice.channels; ++r) from[r] = slice.row(r);
  return gm_draw_rows(from, kGmValue + slice.channels, kGmBase, high, slice.stride,
                      gm_cut(low, high, slice.count, error), out, out_stride, nullptr);
}

// distance[m] = scale (x - mu)^2 of one column (axis 0) or row (axis 1) of texels, and the way x - mu itself.
// Tile: a GmField or GmSlice, for its size.
template <class Tile>
HWY_INLINE void gm_axis(const Tile& field, const float* pair_rows, std::size_t stride, std::size_t count,
                        std::size_t axis, float position, float* way, float* distance) {
  const GmLanes d;
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    GmVec t = hn::Sub(hn::Set(d, position), hn::LoadU(d, pair_rows + (kGmPlace + axis) * stride + m));
    if (field.wraps) t = gm_short(d, t, axis == 0 ? field.width : field.height);
    hn::StoreU(t, d, way + m);
    hn::StoreU(hn::Mul(hn::Mul(t, t), hn::LoadU(d, pair_rows + (kGmWidth + axis) * stride + m)), d,
               distance + m);
  }
}

// Gates of one texel: logits to `gate`, the highest returned.
HWY_INLINE float gm_logits(const float* row_base, const float* column_distance, std::size_t count,
                           float* gate) {
  const GmLanes d;
  GmVec most = hn::Set(d, GM_NEVER);
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const GmVec l = hn::Sub(hn::LoadU(d, row_base + m), hn::LoadU(d, column_distance + m));
    hn::StoreU(l, d, gate + m);
    most = hn::Max(most, l);
  }
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

// Of logits at or above `low`, more than `gates`: takes out the lowest, of equal ones the last.
HWY_INLINE void gm_drop_ties(std::size_t count, std::size_t gates, float low, float* gate) {
  std::size_t kept = 0;
  for (std::size_t m = 0; m < count; ++m) kept += gate[m] >= low;
  for (; kept > gates; --kept) {
    std::size_t worst = count;
    for (std::size_t m = 0; m < count; ++m) {
      if (gate[m] >= low && (worst == count || gate[m] <= gate[worst])) worst = m;
    }
    gate[worst] = GM_NEVER;
  }
}

// Leaves the `gates` highest logits, of equal ones the first, and takes the others out.
HWY_INLINE void gm_keep_best(std::size_t count, std::size_t gates, float most, float* gate) {
  const GmLanes d;
  if (count <= gates) return;
  // Bisection: at least `gates` logits are >= low, fewer are >= high.
  float low = most - 64.0f, high = most;
  // Most of the time they lie within 16 of the highest.
  std::size_t close = 0;
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    close += hn::CountTrue(d, hn::Ge(hn::LoadU(d, gate + m), hn::Set(d, most - 16.0f)));
  }
  if (close >= gates) low = most - 16.0f;
  std::size_t at_least = count;  // logits at or above low, or more
  for (int step = 0; step < 24; ++step) {
    const float middle = 0.5f * (low + high);
    std::size_t above = 0;
    for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
      above += hn::CountTrue(d, hn::Ge(hn::LoadU(d, gate + m), hn::Set(d, middle)));
    }
    if (above >= gates) low = middle;
    if (above >= gates) at_least = above;
    if (above <= gates) high = middle;
    if (above == gates) break;
  }
  if (at_least > gates) gm_drop_ties(count, gates, low, gate);
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const GmVec l = hn::LoadU(d, gate + m);
    hn::StoreU(hn::IfThenElse(hn::Ge(l, hn::Set(d, low)), l, hn::Set(d, GM_NEVER)), d, gate + m);
  }
}

// Logits -> 2^(l - most), in place; their sum and the weighted outputs (not divided by it).
template <std::size_t kChannels>
HWY_INLINE float gm_weigh(const float* values, std::size_t stride, std::size_t count, float most, float* gate,
                          float* sums) {
  const GmLanes d;
  constexpr std::size_t kLanes = hn::MaxLanes(GmLanes());
  GmSum total = gm_no_sum(d), weighted[kChannels];
  for (GmSum& sum : weighted) sum = total;
  for (std::size_t m = 0; m < count; m += kGmPad) {
    for (std::size_t i = 0; i < kGmParts; ++i) {
      const std::size_t at = m + i * kLanes;
      const GmVec l = hn::Sub(hn::LoadU(d, gate + at), hn::Set(d, most));
      // What lies 100 powers below adds nothing, and must not add 2^-126 times M.
      const GmVec w = hn::IfThenElseZero(hn::Gt(l, hn::Set(d, -100.0f)), gm_exp2(d, l));
      hn::StoreU(w, d, gate + at);
      total.part[i] = hn::Add(total.part[i], w);
      for (std::size_t c = 0; c < kChannels; ++c) {
        weighted[c].part[i] = gm_mul_add(w, hn::LoadU(d, values + c * stride + at), weighted[c].part[i]);
      }
    }
  }
  for (std::size_t c = 0; c < kChannels; ++c) sums[c] = gm_total(d, weighted[c]);
  return gm_total(d, total);
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#endif
