// Images and batches with Highway.
#include "format/models/gm_evaluate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "format/models/gm_evaluate.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/models/gm_kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

// Texels a side that share a list; a multiple of every vector's lanes.
constexpr std::size_t kImageTile = 16;

std::size_t padded(std::size_t count) { return (count + kGmPad - 1) / kGmPad * kGmPad; }

HWY_INLINE void weigh(std::size_t channels, const float* values, std::size_t stride, std::size_t count,
                      float most, float* gate, float* out) {
  float total = 0;
  if (channels == 1) total = gm_weigh<1>(values, stride, count, most, gate, out);
  if (channels == 2) total = gm_weigh<2>(values, stride, count, most, gate, out);
  if (channels == 3) total = gm_weigh<3>(values, stride, count, most, gate, out);
  if (channels == 4) total = gm_weigh<4>(values, stride, count, most, gate, out);
  const float inverse = total > 0 ? 1.0f / total : 0.0f;
  for (std::size_t c = 0; c < channels; ++c) out[c] *= inverse;
}

// Middle and half width of some numbers.
HWY_INLINE std::pair<float, float> extent(const float* values, std::size_t count) {
  const auto [low, high] = std::minmax_element(values, values + count);
  return {0.5f * (*low + *high), 0.5f * (*high - *low)};
}

// Room for a tile of an image, all of it rows of `stride` floats.
struct ImageRoom {
  std::size_t stride;
  float *low, *high, *list, *way, *columns, *rows, *gate;
};

// A tile's texels one after another, a lane a component: any number of gates, any logits.
HWY_INLINE void tile_by_texels(const GmSlice& slice, const ImageRoom& r, std::size_t count, std::size_t wide,
                               std::size_t gates, const float* row_base, float* out) {
  for (std::size_t i = 0; i < wide; ++i) {
    const float most = gm_logits(row_base, r.columns + i * r.stride, count, r.gate);
    if (gates > 0) gm_keep_best(count, gates, most, r.gate);
    weigh(slice.channels, r.list + kGmValue * r.stride, r.stride, count, most, r.gate,
          out + i * slice.channels);
  }
}

// A row of kImageTile texels, a lane a texel, over all components; columns[m * kImageTile + i] are distances.
// No logit is above 0, and at every texel one is above -kLeastSure: nothing that counts underflows.
constexpr float kLeastSure = 60;
template <std::size_t kChannels>
HWY_INLINE void row_of_texels(const float* columns, const float* row_base, const float* values,
                              std::size_t stride, std::size_t count, float* out) {
  const GmLanes d;
  for (std::size_t i = 0; i < kImageTile; i += hn::Lanes(d)) {
    GmVec total = hn::Zero(d), s0 = total, s1 = total, s2 = total, s3 = total;
    for (std::size_t m = 0; m < count; ++m) {
      const GmVec l = hn::Sub(hn::Set(d, row_base[m]), hn::LoadU(d, columns + m * kImageTile + i));
      const GmVec w = gm_exp2(d, l);
      total = hn::Add(total, w);
      s0 = gm_mul_add(w, hn::Set(d, values[m]), s0);
      if constexpr (kChannels > 1) s1 = gm_mul_add(w, hn::Set(d, values[stride + m]), s1);
      if constexpr (kChannels > 2) s2 = gm_mul_add(w, hn::Set(d, values[2 * stride + m]), s2);
      if constexpr (kChannels > 3) s3 = gm_mul_add(w, hn::Set(d, values[3 * stride + m]), s3);
    }
    const GmVec inverse = hn::Div(hn::Set(d, 1.0f), total);
    hn::StoreU(hn::Mul(s0, inverse), d, out + i);
    if constexpr (kChannels > 1) hn::StoreU(hn::Mul(s1, inverse), d, out + kImageTile + i);
    if constexpr (kChannels > 2) hn::StoreU(hn::Mul(s2, inverse), d, out + 2 * kImageTile + i);
    if constexpr (kChannels > 3) hn::StoreU(hn::Mul(s3, inverse), d, out + 3 * kImageTile + i);
  }
}

// columns[m * kImageTile + i] = scale (x_i - mu_m)^2.
HWY_INLINE void texel_columns(const GmSlice& slice, const float* list, std::size_t stride, std::size_t count,
                              const float* xs, float* columns) {
  const GmLanes d;
  for (std::size_t m = 0; m < count; ++m) {
    const GmVec mu = hn::Set(d, list[kGmPlace * stride + m]), scale = hn::Set(d, list[kGmWidth * stride + m]);
    for (std::size_t i = 0; i < kImageTile; i += hn::Lanes(d)) {
      GmVec t = hn::Sub(hn::LoadU(d, xs + i), mu);
      if (slice.wraps) t = gm_short(d, t, slice.width);
      hn::StoreU(hn::Mul(hn::Mul(t, t), scale), d, columns + m * kImageTile + i);
    }
  }
}

HWY_INLINE void rows_of_texels(const GmSlice& slice, const ImageRoom& r, std::size_t count, std::size_t wide,
                               const float* row_base, float* out) {
  float planes[kGmMaxChannels * kImageTile];
  const float* values = r.list + kGmValue * r.stride;
  const std::size_t channels = slice.channels;
  if (channels == 1) row_of_texels<1>(r.columns, row_base, values, r.stride, count, planes);
  if (channels == 2) row_of_texels<2>(r.columns, row_base, values, r.stride, count, planes);
  if (channels == 3) row_of_texels<3>(r.columns, row_base, values, r.stride, count, planes);
  if (channels == 4) row_of_texels<4>(r.columns, row_base, values, r.stride, count, planes);
  for (std::size_t i = 0; i < wide; ++i) {
    for (std::size_t c = 0; c < channels; ++c) out[i * channels + c] = planes[c * kImageTile + i];
  }
}

void image_target(const GmSlice& slice, std::span<const float> xs, std::span<const float> ys,
                  const GmEvaluation& how, std::span<float> values) {
  const GmLanes d;
  const std::size_t s = slice.stride + kGmPad;
  std::vector<float> room((2 + kGmPairRows + 1 + kImageTile + 2) * s);
  float* at = room.data();
  const auto take = [&](std::size_t rows) {
    float* out = at;
    at += rows * s;
    return out;
  };
  ImageRoom r{s, take(1), take(1), take(kGmPairRows), take(1), take(kImageTile), take(1), take(1)};
  GmBox box;
  for (std::size_t y0 = 0; y0 < ys.size(); y0 += kImageTile) {
    const std::size_t tall = std::min(kImageTile, ys.size() - y0);
    std::tie(box.y, box.half_y) = extent(ys.data() + y0, tall);
    for (std::size_t x0 = 0; x0 < xs.size(); x0 += kImageTile) {
      const std::size_t wide = std::min(kImageTile, xs.size() - x0);
      std::tie(box.x, box.half_x) = extent(xs.data() + x0, wide);
      const std::size_t kept = gm_select_tile(slice, box, how.error, r.low, r.high, r.list, s);
      const std::size_t count = padded(kept);
      const float sure = *std::max_element(r.low, r.low + slice.count),
                  most = *std::max_element(r.high, r.high + slice.count);
      const bool by_texels = how.gates > 0 || !(most - sure < kLeastSure);
      if (by_texels) {
        for (std::size_t i = 0; i < wide; ++i)
          gm_axis(slice, r.list, s, count, 0, xs[x0 + i], r.way, r.columns + i * s);
      } else {
        float padded_xs[kImageTile];
        for (std::size_t i = 0; i < kImageTile; ++i) padded_xs[i] = xs[x0 + std::min(i, wide - 1)];
        texel_columns(slice, r.list, s, kept, padded_xs, r.columns);
      }
      const GmVec top = hn::Set(d, by_texels ? 0.0f : most);
      for (std::size_t j = 0; j < tall; ++j) {
        gm_axis(slice, r.list, s, count, 1, ys[y0 + j], r.way, r.rows);
        for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
          const GmVec base = hn::Sub(hn::LoadU(d, r.list + kGmBase * s + m), top);
          hn::StoreU(hn::Sub(base, hn::LoadU(d, r.rows + m)), d, r.rows + m);
        }
        float* out = values.data() + ((y0 + j) * xs.size() + x0) * slice.channels;
        if (by_texels) {
          tile_by_texels(slice, r, count, wide, how.gates, r.rows, out);
        } else {
          rows_of_texels(slice, r, kept, wide, r.rows, out);
        }
      }
    }
  }
}

// The box of some queries, by number.
HWY_INLINE GmBox box_of(const GmQuery* queries, std::span<const std::uint32_t> numbers) {
  GmQuery low = queries[numbers[0]], high = low;
  const auto widen = [](float& least, float& most, float v) {
    least = std::min(least, v);
    most = std::max(most, v);
  };
  constexpr std::size_t kAhead = 12;  // queries lie anywhere in memory
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i + kAhead < numbers.size()) __builtin_prefetch(&queries[numbers[i + kAhead]]);
    const GmQuery& q = queries[numbers[i]];
    widen(low.x, high.x, q.x);
    widen(low.y, high.y, q.y);
    for (std::size_t n = 0; n < 4; ++n) {
      widen(low.directions.angle[n], high.directions.angle[n], q.directions.angle[n]);
      widen(low.directions.slope[n], high.directions.slope[n], q.directions.slope[n]);
    }
  }
  GmBox box{0.5f * (low.x + high.x),
            0.5f * (low.y + high.y),
            0.5f * (high.x - low.x),
            0.5f * (high.y - low.y),
            {},
            {}};
  gm_set_directions(low.directions, high.directions, box);
  return box;
}

// Copies the logits at or above `least` to the begin of `out`, which may be `gate`, and their numbers (from
// `from`, or their own) to `index`, padded to a whole vector with what weighs nothing. Both have room for
// kGmPad more than they hold.
HWY_INLINE std::size_t draw_together(const float* gate, const std::int32_t* from, std::size_t count,
                                     float least, float* out, std::int32_t* index) {
  const GmLanes d;
  const hn::RebindToSigned<GmLanes> di;
  const auto lane = hn::Iota(di, 0);  // slow: not in the loop
  std::size_t kept = 0;
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const GmVec l = hn::LoadU(d, gate + m);
    const auto mask = hn::Ge(l, hn::Set(d, least));
    const auto number =
        from == nullptr ? hn::Add(lane, hn::Set(di, static_cast<std::int32_t>(m))) : hn::LoadU(di, from + m);
    hn::StoreU(hn::Compress(l, mask), d, out + kept);
    hn::StoreU(hn::Compress(number, hn::RebindMask(di, mask)), di, index + kept);
    kept += hn::CountTrue(d, mask);
  }
  for (std::size_t m = kept; m < padded(kept + 1); ++m) {
    out[m] = GM_NEVER;
    index[m] = 0;
  }
  return kept;
}

// The expectation over the components of a list whose logits and numbers are given.
template <std::size_t kChannels>
HWY_INLINE void gather_target(const float* gate, const std::int32_t* index, std::size_t count, float best,
                              const float* list, std::size_t s, float* out) {
  const GmLanes d;
  constexpr std::size_t kLanes = hn::MaxLanes(GmLanes());
  GmSum total = gm_no_sum(d), weighted[kChannels];
  for (GmSum& sum : weighted) sum = total;
  for (std::size_t m = 0; m < padded(count); m += kGmPad) {
    for (std::size_t i = 0; i < kGmParts; ++i) {
      const GmVec w = gm_exp2(d, hn::Sub(hn::LoadU(d, gate + m + i * kLanes), hn::Set(d, best)));
      const auto at = hn::LoadU(hn::RebindToSigned<GmLanes>(), index + m + i * kLanes);
      total.part[i] = hn::Add(total.part[i], w);
      for (std::size_t c = 0; c < kChannels; ++c) {
        weighted[c].part[i] =
            gm_mul_add(w, hn::GatherIndex(d, list + (GM_OUTPUT + c) * s, at), weighted[c].part[i]);
      }
    }
  }
  const float inverse = 1.0f / gm_total(d, total);
  for (std::size_t c = 0; c < kChannels; ++c) out[c] = inverse * gm_total(d, weighted[c]);
}

// One query over a list: logits to `gate`, what counts to `near` and `index`, the value to out.
HWY_INLINE void query_target(const GmField& field, const GmQuery& q, const float* list, std::size_t s,
                             std::size_t listed, const GmEvaluation& how, float* gate, float* near,
                             std::int32_t* index, float* out) {
  const GmLanes d;
  const float reach = btfc_log2(static_cast<float>(listed) / how.error);
  GmVec most = hn::Set(d, GM_NEVER);
  for (std::size_t m = 0; m < listed; m += hn::Lanes(d)) {
    const auto row = [&](std::size_t r) HWY_ATTR { return hn::LoadU(d, list + r * s + m); };
    const GmVec hv = row(GM_SHEAR), hl = row(GM_SHEAR + 1);
    GmVec l = row(GM_HEIGHT);
    for (std::size_t n = 0; n < 2; ++n) {
      GmVec t = hn::Sub(hn::Set(d, n == 0 ? q.x : q.y), row(n));
      t = gm_mul_less(hv, hn::Set(d, q.directions.slope[n]), t);
      t = gm_mul_less(hl, hn::Set(d, q.directions.slope[2 + n]), t);
      if (field.wraps) t = gm_short(d, t, n == 0 ? field.width : field.height);
      l = gm_mul_less(row(GM_SCALE + n), hn::Mul(t, t), l);
    }
    for (std::size_t n = 0; n < 4; ++n) {
      const GmVec t = hn::Sub(hn::Set(d, q.directions.angle[n]), row(2 + n));
      l = gm_mul_less(row(GM_SCALE + 2 + n), hn::Mul(t, t), l);
    }
    hn::StoreU(l, d, gate + m);
    most = hn::Max(most, l);
  }
  // Of a list for the whole cell few components count here: they are drawn together first.
  const float best = hn::GetLane(hn::MaxOfLanes(d, most));
  std::size_t kept = draw_together(gate, nullptr, listed, best - reach, near, index);
  if (how.gates > 0 && kept > how.gates) {
    gm_keep_best(padded(kept), how.gates, best, near);
    kept = draw_together(near, index, padded(kept), best - reach, near, index);
  }
  if (field.channels == 1) gather_target<1>(near, index, kept, best, list, s, out);
  if (field.channels == 2) gather_target<2>(near, index, kept, best, list, s, out);
  if (field.channels == 3) gather_target<3>(near, index, kept, best, list, s, out);
  if (field.channels == 4) gather_target<4>(near, index, kept, best, list, s, out);
}

// Queries of one place and view: by number, sorted by the cells of their lights, which begin at `lights`.
void cell_target(const GmField& field, const GmQuery* queries, std::span<const std::uint32_t> numbers,
                 std::span<const std::uint32_t> lights, const GmEvaluation& how, float* room,
                 std::uint32_t* index, float* values) {
  const std::size_t s = field.stride + kGmPad;
  float *upper = room, *lower = room + s, *near = room + 2 * s, *place = room + 3 * s,
        *list = place + kGmFieldRows * s;
  auto* near_index = reinterpret_cast<std::int32_t*>(index);  // signed and unsigned may alias
  // Half of what may be left out here, half for each light.
  const GmCull cull{0, 0.5f * how.error};
  const std::size_t placed =
      padded(gm_select_box(field, {field.data.data(), field.stride, field.stride}, box_of(queries, numbers),
                           cull, upper, lower, place, s, index));
  for (std::size_t b = 0; b + 1 < lights.size(); ++b) {
    const auto some = numbers.subspan(lights[b], lights[b + 1] - lights[b]);
    if (some.empty()) continue;
    const std::size_t listed = padded(
        gm_select_box(field, {place, s, placed}, box_of(queries, some), cull, upper, lower, list, s, index));
    for (const std::uint32_t number : some) {
      query_target(field, queries[number], list, s, listed, how, upper, near, near_index,
                   values + std::size_t{number} * field.channels);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(image_target);
HWY_EXPORT(cell_target);

namespace {

// Parts of each input that make up cells.
constexpr std::uint32_t kPartsOfSide = 8, kPartsOfAngle = 4;
constexpr std::uint32_t kLightCells = kPartsOfAngle * kPartsOfAngle;
constexpr std::uint32_t kPlaceCells = kPartsOfSide * kPartsOfSide * kPartsOfAngle * kPartsOfAngle;

std::uint32_t part(float value, float low, float high, std::uint32_t parts) {
  const float share = (value - low) / (high - low) * static_cast<float>(parts);
  return static_cast<std::uint32_t>(std::clamp(share, 0.0f, static_cast<float>(parts) - 0.5f));
}

std::uint32_t cell_of(const GmField& field, const GmQuery& q) {
  std::uint32_t cell =
      part(q.x, 0, field.width, kPartsOfSide) * kPartsOfSide + part(q.y, 0, field.height, kPartsOfSide);
  for (std::size_t n = 0; n < 4; ++n)
    cell = cell * kPartsOfAngle + part(q.directions.angle[n], -1.5708f, 1.5708f, kPartsOfAngle);
  return cell;
}

}  // namespace

void gm_evaluate_image(const GmSlice& slice, std::span<const float> xs, std::span<const float> ys,
                       const GmEvaluation& how, std::span<float> values) {
  if (xs.empty() || ys.empty()) return;
  HWY_DYNAMIC_DISPATCH(image_target)(slice, xs, ys, how, values);
}

void gm_evaluate_batch(const GmField& field, std::span<const GmQuery> queries, const GmEvaluation& how,
                       std::span<float> values) {
  constexpr std::uint32_t kCells = kPlaceCells * kLightCells;
  std::vector<std::uint32_t> cell(queries.size()), first(kCells + 1, 0), numbers(queries.size());
  for (std::size_t q = 0; q < queries.size(); ++q) ++first[(cell[q] = cell_of(field, queries[q])) + 1];
  for (std::uint32_t c = 0; c < kCells; ++c) first[c + 1] += first[c];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t q = 0; q < queries.size(); ++q) numbers[next[cell[q]]++] = q;
  const std::size_t s = field.stride + kGmPad;
  std::vector<float> room((3 + 2 * kGmFieldRows) * s);
  std::vector<std::uint32_t> index(s), lights(kLightCells + 1);
  for (std::uint32_t c = 0; c < kCells; c += kLightCells) {
    const std::uint32_t begin = first[c], end = first[c + kLightCells];
    if (begin == end) continue;
    for (std::uint32_t l = 0; l <= kLightCells; ++l) lights[l] = first[c + l] - begin;
    HWY_DYNAMIC_DISPATCH(cell_target)
    (field, queries.data(), std::span(numbers).subspan(begin, end - begin), lights, how, room.data(),
     index.data(), values.data());
  }
}

void gm_evaluate_plain(const GmField& field, std::span<const GmQuery> queries, std::uint32_t gates,
                       std::span<float> values) {
  std::vector<double> gate(field.components), ranked;
  const auto number = [&](std::size_t r, std::size_t m) {
    return static_cast<double>(field.row(static_cast<std::uint32_t>(r))[m]);
  };
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const GmQuery& q = queries[i];
    double most = -1e300;
    for (std::size_t m = 0; m < field.components; ++m) {
      double l = number(GM_HEIGHT, m);
      for (std::size_t n = 0; n < 2; ++n) {
        double t = static_cast<double>(n == 0 ? q.x : q.y) - number(n, m) -
                   number(GM_SHEAR, m) * static_cast<double>(q.directions.slope[n]) -
                   number(GM_SHEAR + 1, m) * static_cast<double>(q.directions.slope[2 + n]);
        const double period = static_cast<double>(n == 0 ? field.width : field.height);
        if (field.wraps) t -= period * std::nearbyint(t / period);
        l -= number(GM_SCALE + n, m) * t * t;
      }
      for (std::size_t n = 0; n < 4; ++n) {
        const double t = static_cast<double>(q.directions.angle[n]) - number(2 + n, m);
        l -= number(GM_SCALE + 2 + n, m) * t * t;
      }
      gate[m] = l;
      most = std::max(most, l);
    }
    double least = -1e300;
    if (gates > 0 && gates < gate.size()) {
      ranked = gate;
      std::nth_element(ranked.begin(), ranked.begin() + (gates - 1), ranked.end(), std::greater<>());
      least = ranked[gates - 1];
    }
    double total = 0, sums[kGmMaxChannels] = {};
    for (std::size_t m = 0; m < field.components; ++m) {
      if (gate[m] < least) continue;
      const double w = std::exp2(gate[m] - most);
      total += w;
      for (std::size_t c = 0; c < field.channels; ++c) sums[c] += w * number(GM_OUTPUT + c, m);
    }
    for (std::size_t c = 0; c < field.channels; ++c) {
      values[i * field.channels + c] = static_cast<float>(total > 0 ? sums[c] / total : 0);
    }
  }
}

}  // namespace btfc
#endif
