// Error and gradient with Highway. The exponents of a rectangle under one pair are sums of a table of
// columns, one of rows and one of the pair, and the gradient goes back through the same three sums.
#include "encoder/models/gm_gradient.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/gm_gradient.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/models/gm_kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

// Per component and pair: what the chain rule needs of the rectangle. Moments are of dE/dl over texels.
constexpr std::size_t kSum = 0;      // of dE/dl
constexpr std::size_t kFirst = 1;    // x, y: times the way
constexpr std::size_t kSecond = 3;   // x, y: times its square
constexpr std::size_t kOutputs = 5;  // dE/d output, four
constexpr std::size_t kUsage = 9;
constexpr std::size_t kError = 10;
constexpr std::size_t kMoments = 11;

// Per component of a group's list, over pairs: sums of the above, angular moments, and drifts.
constexpr std::size_t kAngleFirst = 11;   // four
constexpr std::size_t kAngleSecond = 15;  // four
constexpr std::size_t kDrift = 19;        // x by view, y by view, x by light, y by light
constexpr std::size_t kGroupSums = 23;

struct Room {
  std::size_t stride;  // components of the field
  float *upper, *base, *place_x, *place_y;
  float* list;            // kGmFieldRows rows: of the group
  float* pair;            // kGmPairRows rows
  float *way, *distance;  // kGmTile columns, then kGmTile rows
  float *columns, *rows;  // dE/dl summed over rows, over columns
  float *row_base, *gate;
  float* moments;     // kMoments rows, of the pair's list
  float* spread_out;  // kMoments rows, at the group's places
  float* sums;        // kGroupSums rows
  std::uint32_t *group_index, *pair_index;
};

Room make_room(const GmField& field, GmScratch& scratch) {
  const std::size_t s = field.stride + kGmPad;
  const std::size_t rows =
      4 + kGmFieldRows + kGmPairRows + 4 * kGmTile + 2 * kGmTile + 2 + 2 * kMoments + kGroupSums;
  scratch.floats.resize(rows * s);
  scratch.numbers.resize(2 * s);
  float* at = scratch.floats.data();
  const auto take = [&](std::size_t count) {
    float* out = at;
    at += count * s;
    return out;
  };
  Room r{};
  r.stride = s;
  r.upper = take(1);
  r.base = take(1);
  r.place_x = take(1);
  r.place_y = take(1);
  r.list = take(kGmFieldRows);
  r.pair = take(kGmPairRows);
  r.way = take(2 * kGmTile);
  r.distance = take(2 * kGmTile);
  r.columns = take(kGmTile);
  r.rows = take(kGmTile);
  r.row_base = take(1);
  r.gate = take(1);
  r.moments = take(kMoments);
  r.spread_out = take(kMoments);
  r.sums = take(kGroupSums);
  r.group_index = scratch.numbers.data();
  r.pair_index = scratch.numbers.data() + s;
  return r;
}

// One texel: gates are weights before division by their sum; difference = y - t; weight: of the
// pair.
template <std::size_t kChannels>
HWY_INLINE void add_texel(const Room& r, std::size_t count, const float* difference, float weight,
                          const float* value, float inverse, std::size_t i, std::size_t j, bool statistics) {
  const GmLanes d;
  float error[kChannels], mean = 0, square = 0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    error[c] = weight * difference[c];
    mean += error[c] * value[c];
    square += difference[c] * difference[c];
  }
  const GmVec over = hn::Set(d, inverse), less = hn::Set(d, mean);
  const GmVec e0 = hn::Set(d, error[0]), e1 = hn::Set(d, kChannels > 1 ? error[1] : 0),
              e2 = hn::Set(d, kChannels > 2 ? error[2] : 0), e3 = hn::Set(d, kChannels > 3 ? error[3] : 0);
  float* column = r.columns + i * r.stride;
  float* row = r.rows + j * r.stride;
  const auto add = [&](std::size_t which, std::size_t m, GmVec e, GmVec g) HWY_ATTR {
    float* at = r.moments + (kOutputs + which) * r.stride + m;
    hn::StoreU(hn::MulAdd(e, g, hn::LoadU(d, at)), d, at);
  };
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const GmVec g = hn::Mul(hn::LoadU(d, r.gate + m), over);
    const float* values = r.pair + kGmValue * r.stride + m;
    GmVec t = hn::NegMulAdd(e0, hn::LoadU(d, values), less);
    if constexpr (kChannels > 1) t = hn::NegMulAdd(e1, hn::LoadU(d, values + r.stride), t);
    if constexpr (kChannels > 2) t = hn::NegMulAdd(e2, hn::LoadU(d, values + 2 * r.stride), t);
    if constexpr (kChannels > 3) t = hn::NegMulAdd(e3, hn::LoadU(d, values + 3 * r.stride), t);
    const GmVec q = hn::Mul(g, t);  // - dE/dl / ln 2
    hn::StoreU(hn::Sub(hn::LoadU(d, column + m), q), d, column + m);
    hn::StoreU(hn::Sub(hn::LoadU(d, row + m), q), d, row + m);
    add(0, m, e0, g);
    if constexpr (kChannels > 1) add(1, m, e1, g);
    if constexpr (kChannels > 2) add(2, m, e2, g);
    if constexpr (kChannels > 3) add(3, m, e3, g);
  }
  if (!statistics) return;
  const GmVec squares = hn::Set(d, square), weighted_over = hn::Set(d, weight * inverse);
  for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
    const GmVec g = hn::Mul(hn::LoadU(d, r.gate + m), weighted_over);
    float* usage = r.moments + kUsage * r.stride + m;
    float* lost = r.moments + kError * r.stride + m;
    hn::StoreU(hn::Add(hn::LoadU(d, usage), g), d, usage);
    hn::StoreU(hn::MulAdd(squares, g, hn::LoadU(d, lost)), d, lost);
  }
}

// Moments over columns and rows.
HWY_INLINE void finish_pair(const Room& r, std::size_t count, const GmVisit& visit) {
  float* const m = r.moments;
  gm_tile_moments({r.columns, r.rows, r.way, kGmTile, r.stride, m + kSum * r.stride, m + kFirst * r.stride,
                   m + kSecond * r.stride},
                  count, visit.width, visit.height);
}

// The pair's moments into the group's sums.
HWY_INLINE void add_pair(const Room& r, std::size_t group_count, std::size_t pair_count,
                         const GmPairInputs& pair, bool statistics) {
  const GmLanes d;
  const std::size_t kinds = statistics ? kMoments : kUsage;
  for (std::size_t k = 0; k < kinds; ++k) {
    float* to = r.spread_out + k * r.stride;
    const float* from = r.moments + k * r.stride;
    std::fill_n(to, group_count, 0.0f);
    for (std::size_t m = 0; m < pair_count; ++m) to[r.pair_index[m]] = from[m];
  }
  for (std::size_t m = 0; m < group_count; m += hn::Lanes(d)) {
    const auto moment = [&](std::size_t k) HWY_ATTR { return hn::LoadU(d, r.spread_out + k * r.stride + m); };
    const auto add = [&](std::size_t k, GmVec v) HWY_ATTR {
      float* at = r.sums + k * r.stride + m;
      hn::StoreU(hn::Add(hn::LoadU(d, at), v), d, at);
    };
    for (std::size_t k = 0; k < kinds; ++k) add(k, moment(k));
    const GmVec q = moment(kSum);
    for (std::size_t n = 0; n < 4; ++n) {
      const GmVec t = hn::Sub(hn::Set(d, pair.angle[n]), hn::LoadU(d, r.list + (2 + n) * r.stride + m));
      const GmVec weighted = hn::Mul(q, t);
      add(kAngleFirst + n, weighted);
      add(kAngleSecond + n, hn::Mul(weighted, t));
      add(kDrift + n, hn::Mul(moment(kFirst + n % 2), hn::Set(d, pair.slope[n])));
    }
  }
}

// The group's sums into the whole gradient: l = height - sum of scale (s - mu)^2, dl/dmu = 2 scale (s - mu),
// dl/dlog2 sigma = 2 ln 2 scale (s - mu)^2; and dE/dl carries ln 2.
void add_group(const Room& r, std::size_t count, std::size_t stride, bool statistics, GmSums& sums) {
  const GmLanes d;
  constexpr float kLn2 = 0.69314718f;
  const auto finish = [&](std::size_t from, std::size_t scale_row, float factor) HWY_ATTR {
    for (std::size_t m = 0; m < count; m += hn::Lanes(d)) {
      float* at = r.sums + from * r.stride + m;
      GmVec v = hn::Mul(hn::LoadU(d, at), hn::Set(d, factor));
      if (scale_row < kGmFieldRows) v = hn::Mul(v, hn::LoadU(d, r.list + scale_row * r.stride + m));
      hn::StoreU(v, d, at);
    }
  };
  const auto scatter = [&](std::size_t from, float* to) {
    for (std::size_t m = 0; m < count; ++m) to[r.group_index[m]] += r.sums[from * r.stride + m];
  };
  const auto give = [&](std::size_t from, std::size_t scale_row, float factor, std::size_t row) {
    finish(from, scale_row, factor);
    scatter(from, sums.gradient.data() + row * stride);
  };
  for (std::size_t n = 0; n < 2; ++n) {
    give(kFirst + n, GM_SCALE + n, 2 * kLn2, kGmMeanRow + n);
    give(kSecond + n, GM_SCALE + n, 2 * kLn2 * kLn2, kGmSpreadRow + n);
  }
  for (std::size_t n = 0; n < 4; ++n) {
    give(kAngleFirst + n, GM_SCALE + 2 + n, 2 * kLn2, kGmMeanRow + 2 + n);
    give(kAngleSecond + n, GM_SCALE + 2 + n, 2 * kLn2 * kLn2, kGmSpreadRow + 2 + n);
    give(kOutputs + n, kGmFieldRows, 1, GM_OUTPUT + n);
    give(kDrift + n, GM_SCALE + n % 2, 2 * kLn2, GM_SHEAR + n / 2);
  }
  give(kSum, kGmFieldRows, kLn2, kGmHeightRow);
  if (!statistics) return;
  scatter(kUsage, sums.usage.data());
  scatter(kError, sums.error.data());
}

template <std::size_t kChannels>
void visit_target(const GmField& field, const GmSamples& samples, const GmVisit& visit,
                  const GmGradientOptions& options, GmScratch& scratch, GmSums& sums) {
  const Room r = make_room(field, scratch);
  GmBox box = visit.group->box;
  box.half_x = 0.5f * static_cast<float>(visit.width - 1);
  box.half_y = 0.5f * static_cast<float>(visit.height - 1);
  box.x = static_cast<float>(visit.x) + 0.5f + box.half_x;
  box.y = static_cast<float>(visit.y) + 0.5f + box.half_y;
  const GmRows all{field.data.data(), field.stride, field.stride};
  const std::size_t group_count =
      gm_select_box(field, all, box, {options.reach, 0}, r.upper, nullptr, r.list, r.stride, r.group_index);
  const std::size_t group_padded = (group_count + kGmPad - 1) / kGmPad * kGmPad;
  const GmRows list{r.list, r.stride, group_padded};
  if (options.gradient) {
    for (std::size_t k = 0; k < kGroupSums; ++k) std::fill_n(r.sums + k * r.stride, group_padded, 0.0f);
  }
  for (const std::uint32_t p : visit.pairs) {
    box.middle = samples.pairs[p];
    const std::size_t count = gm_select_pair(field, list, box, options.reach, r.upper, r.base, r.place_x,
                                             r.place_y, r.pair, r.stride, r.pair_index);
    const std::size_t padded = (count + kGmPad - 1) / kGmPad * kGmPad;
    sums.listed += count * visit.width * visit.height;
    for (std::size_t i = 0; i < visit.width; ++i) {
      gm_axis(field, r.pair, r.stride, padded, 0, static_cast<float>(visit.x + i) + 0.5f,
              r.way + i * r.stride, r.distance + i * r.stride);
    }
    for (std::size_t j = 0; j < visit.height; ++j) {
      gm_axis(field, r.pair, r.stride, padded, 1, static_cast<float>(visit.y + j) + 0.5f,
              r.way + (kGmTile + j) * r.stride, r.distance + (kGmTile + j) * r.stride);
    }
    if (options.gradient) {
      for (std::size_t i = 0; i < visit.width; ++i) std::fill_n(r.columns + i * r.stride, padded, 0.0f);
      for (std::size_t j = 0; j < visit.height; ++j) std::fill_n(r.rows + j * r.stride, padded, 0.0f);
      for (std::size_t k = kOutputs; k < kMoments; ++k) std::fill_n(r.moments + k * r.stride, padded, 0.0f);
    }
    float targets[kGmTile * kGmTile * kChannels];
    samples.rectangle(p, visit.x, visit.y, visit.width, visit.height, targets);
    const float* target = targets;
    const float* mean = samples.mean.data() + std::size_t{p} * kChannels;
    double squares = 0;
    for (std::size_t j = 0; j < visit.height; ++j) {
      const GmLanes d;
      for (std::size_t m = 0; m < padded; m += hn::Lanes(d)) {
        hn::StoreU(hn::Sub(hn::LoadU(d, r.pair + kGmBase * r.stride + m),
                           hn::LoadU(d, r.distance + (kGmTile + j) * r.stride + m)),
                   d, r.row_base + m);
      }
      for (std::size_t i = 0; i < visit.width; ++i) {
        const float most = gm_logits(r.row_base, r.distance + i * r.stride, padded, r.gate);
        if (options.gates > 0) gm_keep_best(padded, options.gates, most, r.gate);
        float value[4] = {}, error[4] = {};
        const float total =
            gm_weigh<kChannels>(r.pair + kGmValue * r.stride, r.stride, padded, most, r.gate, value);
        const float inverse = 1.0f / total;
        for (std::uint32_t c = 0; c < kChannels; ++c) {
          value[c] *= inverse;
          const float shown = value[c] + mean[c];
          error[c] = std::clamp(shown, samples.low, samples.high) - mean[c] - *target++;
          squares += static_cast<double>(error[c] * error[c]);
        }
        if (options.gradient) {
          add_texel<kChannels>(r, padded, error, samples.weights[p], value, inverse, i, j,
                               options.statistics);
        }
      }
    }
    sums.squared_error += double{samples.weights[p]} * squares;
    sums.samples += std::uint64_t{visit.width} * visit.height;
    if (options.gradient) {
      finish_pair(r, padded, visit);
      add_pair(r, group_padded, count, box.middle, options.statistics);
    }
  }
  if (options.gradient) add_group(r, group_count, field.stride, options.statistics, sums);
}

void visit_1(const GmField& f, const GmSamples& s, const GmVisit& v, const GmGradientOptions& o,
             GmScratch& scratch, GmSums& sums) {
  visit_target<1>(f, s, v, o, scratch, sums);
}
void visit_2(const GmField& f, const GmSamples& s, const GmVisit& v, const GmGradientOptions& o,
             GmScratch& scratch, GmSums& sums) {
  visit_target<2>(f, s, v, o, scratch, sums);
}
void visit_3(const GmField& f, const GmSamples& s, const GmVisit& v, const GmGradientOptions& o,
             GmScratch& scratch, GmSums& sums) {
  visit_target<3>(f, s, v, o, scratch, sums);
}
void visit_4(const GmField& f, const GmSamples& s, const GmVisit& v, const GmGradientOptions& o,
             GmScratch& scratch, GmSums& sums) {
  visit_target<4>(f, s, v, o, scratch, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cmath>

namespace btfc {

HWY_EXPORT(visit_1);
HWY_EXPORT(visit_2);
HWY_EXPORT(visit_3);
HWY_EXPORT(visit_4);

void GmSums::clear(std::size_t stride) {
  gradient.assign(kGmFieldRows * stride, 0.0f);
  usage.assign(stride, 0.0f);
  error.assign(stride, 0.0f);
  squared_error = 0;
  samples = listed = 0;
}

void gm_add_gradient(const GmField& field, const GmSamples& samples, const GmVisit& visit,
                     const GmGradientOptions& options, GmScratch& scratch, GmSums& sums) {
  if (samples.channels == 1) HWY_DYNAMIC_DISPATCH(visit_1)(field, samples, visit, options, scratch, sums);
  if (samples.channels == 2) HWY_DYNAMIC_DISPATCH(visit_2)(field, samples, visit, options, scratch, sums);
  if (samples.channels == 3) HWY_DYNAMIC_DISPATCH(visit_3)(field, samples, visit, options, scratch, sums);
  if (samples.channels == 4) HWY_DYNAMIC_DISPATCH(visit_4)(field, samples, visit, options, scratch, sums);
}

void gm_add_gradient_plain(const GmMixture& mixture, const GmSamples& samples, const GmVisit& visit,
                           GmPlainSums& sums) {
  const GmShape& shape = mixture.shape;
  const std::size_t count = shape.components;
  sums.gradient.resize(kGmFieldRows * count);
  std::vector<double> gate(count), way(count * kGmInputs);
  const auto number = [&](std::uint32_t row, std::size_t m) { return double{mixture.row(row)[m]}; };
  for (const std::uint32_t p : visit.pairs) {
    const GmPairInputs& pair = samples.pairs[p];
    for (std::uint32_t y = visit.y; y < visit.y + visit.height; ++y) {
      for (std::uint32_t x = visit.x; x < visit.x + visit.width; ++x) {
        double most = -1e300, total = 0;
        for (std::size_t m = 0; m < count; ++m) {
          double in[kGmInputs] = {x + 0.5,       y + 0.5,       pair.angle[0],
                                  pair.angle[1], pair.angle[2], pair.angle[3]};
          for (std::uint32_t h = 0; h < 2 && shape.shear; ++h) {
            in[0] -= number(shape.shear_row() + h, m) * double{pair.slope[2 * h]};
            in[1] -= number(shape.shear_row() + h, m) * double{pair.slope[2 * h + 1]};
          }
          gate[m] = number(kGmHeightRow, m);
          for (std::uint32_t n = 0; n < kGmInputs; ++n) {
            double t = in[n] - number(kGmMeanRow + n, m);
            const double period = n == 0 ? samples.width : samples.height;
            if (n < 2 && samples.wraps) t -= period * std::nearbyint(t / period);
            way[n * count + m] = t;
            gate[m] -= 0.5 / std::log(2.0) * std::exp2(-2 * number(kGmSpreadRow + n, m)) * t * t;
          }
          most = std::max(most, gate[m]);
        }
        for (double& g : gate) total += g = std::exp2(g - most);
        double value[4] = {}, error[4] = {};
        for (std::uint32_t c = 0; c < shape.channels; ++c) {
          for (std::size_t m = 0; m < count; ++m) value[c] += gate[m] / total * number(kGmOutputRow + c, m);
          const double shown = value[c] + double{samples.mean[std::size_t{p} * shape.channels + c]};
          error[c] = std::clamp(shown, double{samples.low}, double{samples.high}) -
                     double{samples.value(p, x, y, c)};
          sums.squared_error += double{samples.weights[p]} * error[c] * error[c];
          error[c] *= double{samples.weights[p]};
        }
        for (std::size_t m = 0; m < count; ++m) {
          const double g = gate[m] / total;
          double q = 0;
          for (std::uint32_t c = 0; c < shape.channels; ++c) {
            q += error[c] * (number(kGmOutputRow + c, m) - value[c]);
            sums.gradient[(GM_OUTPUT + c) * count + m] += error[c] * g;
          }
          q *= g * std::log(2.0);
          sums.gradient[kGmHeightRow * count + m] += q;
          for (std::uint32_t n = 0; n < kGmInputs; ++n) {
            const double t = way[n * count + m];
            const double scale = 0.5 / std::log(2.0) * std::exp2(-2 * number(kGmSpreadRow + n, m));
            sums.gradient[(kGmMeanRow + n) * count + m] += 2 * q * scale * t;
            sums.gradient[(kGmSpreadRow + n) * count + m] += 2 * std::log(2.0) * q * scale * t * t;
            for (std::uint32_t h = 0; h < 2 && n < 2; ++h) {
              sums.gradient[(GM_SHEAR + h) * count + m] += 2 * q * scale * t * double{pair.slope[2 * h + n]};
            }
          }
        }
      }
    }
  }
}

}  // namespace btfc
#endif
