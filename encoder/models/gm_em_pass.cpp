// The expectation step with Highway: eqs 3, 4 and the sums of eqs 5-7. Of the exponents of a rectangle under
// one pair, those of x, y and the four angles are sums of tables of columns, rows and the pair.
#include <algorithm>

#include "encoder/models/gm_em.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/gm_em_pass.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/models/gm_kernels-inl.h"

#ifndef BTFC_GM_EM_TILE
#define BTFC_GM_EM_TILE
namespace btfc {

inline constexpr std::uint32_t kEmTile = 8;

// The mixture in single precision: rows of means, of scales, and the peak's log2.
struct EmField {
  std::uint32_t components = 0, stride = 0, channels = 0;
  std::vector<float> mean, scale, height;
};

struct EmTile {
  std::uint32_t x, y, width, height;
};

struct EmScratch {
  std::vector<float> floats;
  std::vector<std::uint32_t> index;
};

}  // namespace btfc
#endif

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

// Per component of a list.
constexpr std::size_t kEmBase = 0, kEmMean = 1 /* x, y, channels */, kEmScale = 7, kEmRows = 13;
// Sums over a rectangle: of responsibilities, then first and second moments of x, y and channels.
constexpr std::size_t kEmSum = 0, kEmFirst = 1, kEmSecond = 7, kEmMoments = 13;

struct EmRoom {
  std::size_t stride;
  float *upper, *base, *list, *way, *distance, *columns, *rows, *row_base, *gate, *moments;
  std::uint32_t* index;
};

EmRoom em_room(const EmField& field, EmScratch& scratch) {
  const std::size_t s = field.stride + kGmPad;
  scratch.floats.resize((4 + kEmRows + 6 * kEmTile + kEmMoments) * s);
  scratch.index.resize(s);
  float* at = scratch.floats.data();
  const auto take = [&](std::size_t count) {
    float* out = at;
    at += count * s;
    return out;
  };
  EmRoom r{};
  r.stride = s;
  r.upper = take(1);
  r.base = take(1);
  r.list = take(kEmRows);
  r.way = take(2 * kEmTile);
  r.distance = take(2 * kEmTile);
  r.columns = take(kEmTile);
  r.rows = take(kEmTile);
  r.row_base = take(1);
  r.gate = take(1);
  r.moments = take(kEmMoments);
  r.index = scratch.index.data();
  return r;
}

// A rectangle with its colours: middles and half widths.
struct EmBox {
  float middle[6], half[6];  // x, y, channels
};

// Of EmField's dimensions: 0, 1 and 6 … are those of a box.
constexpr std::size_t em_dimension(std::size_t n) { return n < 2 ? n : n + 4; }

HWY_INLINE std::size_t em_select(const EmField& field, const GmSamples& samples, const GmPairInputs& pair,
                                 const EmBox& box, float reach, const EmRoom& r) {
  const GmLanes d;
  const std::size_t lanes = hn::Lanes(d), dims = 2 + field.channels;
  GmVec sure = hn::Set(d, GM_NEVER);
  const GmVec zero = hn::Zero(d);
  for (std::size_t m = 0; m < field.stride; m += lanes) {
    GmVec high = hn::LoadU(d, field.height.data() + m);
    for (std::size_t n = 0; n < 4; ++n) {
      const GmVec t =
          hn::Sub(hn::Set(d, pair.angle[n]), hn::LoadU(d, field.mean.data() + (2 + n) * field.stride + m));
      high =
          hn::NegMulAdd(hn::LoadU(d, field.scale.data() + (2 + n) * field.stride + m), hn::Mul(t, t), high);
    }
    hn::StoreU(high, d, r.base + m);
    GmVec low = high;
    for (std::size_t n = 0; n < dims; ++n) {
      const std::size_t row = em_dimension(n) * field.stride + m;
      GmVec t = hn::Sub(hn::Set(d, box.middle[n]), hn::LoadU(d, field.mean.data() + row));
      if (n < 2 && samples.wraps) {
        t = gm_short(d, t, static_cast<float>(n == 0 ? samples.width : samples.height));
      }
      const GmVec half = hn::Set(d, box.half[n]), scale = hn::LoadU(d, field.scale.data() + row);
      const GmVec near = hn::Max(hn::Sub(hn::Abs(t), half), zero), far = hn::Add(hn::Abs(t), half);
      high = hn::NegMulAdd(scale, hn::Mul(near, near), high);
      low = hn::NegMulAdd(scale, hn::Mul(far, far), low);
    }
    hn::StoreU(high, d, r.upper + m);
    sure = hn::Max(sure, low);
  }
  const GmVec least =
      reach > 0 ? hn::Set(d, hn::GetLane(hn::MaxOfLanes(d, sure)) - reach) : hn::Set(d, 0.5f * GM_NEVER);
  std::size_t kept = 0;
  const hn::RebindToUnsigned<GmLanes> du;
  const auto lane = hn::Iota(du, 0);  // slow: not in the loop
  for (std::size_t m = 0; m < field.stride; m += lanes) {
    const auto mask = hn::Ge(hn::LoadU(d, r.upper + m), least);
    const std::size_t count = hn::CountTrue(d, mask);
    if (count == 0) continue;
    const auto keep = [&](const float* from, std::size_t row) HWY_ATTR {
      hn::StoreU(hn::Compress(hn::LoadU(d, from), mask), d, r.list + row * r.stride + kept);
    };
    keep(r.base + m, kEmBase);
    for (std::size_t n = 0; n < dims; ++n) {
      keep(field.mean.data() + em_dimension(n) * field.stride + m, kEmMean + n);
      keep(field.scale.data() + em_dimension(n) * field.stride + m, kEmScale + n);
    }
    hn::StoreU(
        hn::Compress(hn::Add(lane, hn::Set(du, static_cast<std::uint32_t>(m))), hn::RebindMask(du, mask)), du,
        r.index + kept);
    kept += count;
  }
  for (std::size_t m = kept; m < (kept + kGmPad - 1) / kGmPad * kGmPad; ++m) {
    for (std::size_t row = 0; row < kEmRows; ++row) r.list[row * r.stride + m] = 0;
    r.list[kEmBase * r.stride + m] = GM_NEVER;
  }
  return kept;
}

template <std::size_t kChannels>
HWY_INLINE double em_texel(const EmRoom& r, std::size_t count, const float* colour, float weight,
                           std::size_t i, std::size_t j) {
  const GmLanes d;
  const std::size_t lanes = hn::Lanes(d);
  GmVec most = hn::Set(d, GM_NEVER);
  for (std::size_t m = 0; m < count; m += lanes) {
    GmVec l = hn::Sub(hn::LoadU(d, r.row_base + m), hn::LoadU(d, r.distance + i * r.stride + m));
    for (std::size_t c = 0; c < kChannels; ++c) {
      const GmVec t = hn::Sub(hn::Set(d, colour[c]), hn::LoadU(d, r.list + (kEmMean + 2 + c) * r.stride + m));
      l = hn::NegMulAdd(hn::Mul(t, t), hn::LoadU(d, r.list + (kEmScale + 2 + c) * r.stride + m), l);
    }
    hn::StoreU(l, d, r.gate + m);
    most = hn::Max(most, l);
  }
  most = hn::MaxOfLanes(d, most);
  GmVec total = hn::Zero(d);
  for (std::size_t m = 0; m < count; m += lanes) {
    const GmVec l = hn::Sub(hn::LoadU(d, r.gate + m), most);
    const GmVec w = hn::IfThenElseZero(hn::Gt(l, hn::Set(d, -100.0f)), gm_exp2(d, l));
    hn::StoreU(w, d, r.gate + m);
    total = hn::Add(total, w);
  }
  const float sum = hn::GetLane(hn::SumOfLanes(d, total));
  const GmVec over = hn::Set(d, weight / sum);
  float* column = r.columns + i * r.stride;
  float* row = r.rows + j * r.stride;
  for (std::size_t m = 0; m < count; m += lanes) {
    const GmVec q = hn::Mul(hn::LoadU(d, r.gate + m), over);
    hn::StoreU(hn::Add(hn::LoadU(d, column + m), q), d, column + m);
    hn::StoreU(hn::Add(hn::LoadU(d, row + m), q), d, row + m);
    for (std::size_t c = 0; c < kChannels; ++c) {
      const GmVec t = hn::Sub(hn::Set(d, colour[c]), hn::LoadU(d, r.list + (kEmMean + 2 + c) * r.stride + m));
      float* first = r.moments + (kEmFirst + 2 + c) * r.stride + m;
      float* second = r.moments + (kEmSecond + 2 + c) * r.stride + m;
      const GmVec weighted = hn::Mul(q, t);
      hn::StoreU(hn::Add(hn::LoadU(d, first), weighted), d, first);
      hn::StoreU(hn::MulAdd(weighted, t, hn::LoadU(d, second)), d, second);
    }
  }
  return static_cast<double>(hn::GetLane(most)) + std::log2(static_cast<double>(sum));
}

HWY_INLINE void em_axes(const EmRoom& r, std::size_t count, const EmTile& tile) {
  float* const m = r.moments;
  gm_tile_moments({r.columns, r.rows, r.way, kEmTile, r.stride, m + kEmSum * r.stride,
                   m + kEmFirst * r.stride, m + kEmSecond * r.stride},
                  count, tile.width, tile.height);
}

// A rectangle's moments into the sums, in doubles.
void em_add(const EmField& field, const EmRoom& r, std::size_t count, const GmPairInputs& pair,
            GmEmSums& sums) {
  const std::size_t components = field.components, dims = 2 + field.channels;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t m = r.index[i];
    const double q = static_cast<double>(r.moments[kEmSum * r.stride + i]);
    if (q == 0) continue;
    sums.sum[m] += q;
    for (std::size_t n = 0; n < dims; ++n) {
      const std::size_t at = em_dimension(n) * components + m;
      sums.first[at] += static_cast<double>(r.moments[(kEmFirst + n) * r.stride + i]);
      sums.second[at] += static_cast<double>(r.moments[(kEmSecond + n) * r.stride + i]);
    }
    for (std::size_t n = 0; n < 4; ++n) {
      const double way = static_cast<double>(pair.angle[n] - field.mean[(2 + n) * field.stride + m]);
      sums.first[(2 + n) * components + m] += q * way;
      sums.second[(2 + n) * components + m] += q * way * way;
    }
  }
}

template <std::size_t kChannels>
void em_tile(const EmField& field, const GmSamples& samples, const EmTile& tile, const GmEmPass& pass,
             EmScratch& scratch, GmEmSums& sums) {
  const GmLanes d;
  const EmRoom r = em_room(field, scratch);
  float colours[kEmTile * kEmTile * kChannels];
  const std::size_t tile_number = tile.y / kEmTile * 31 + tile.x / kEmTile;
  for (std::size_t p = (pass.phase + tile_number) % pass.every; p < samples.pairs.size(); p += pass.every) {
    const GmPairInputs& pair = samples.pairs[p];
    float low[kChannels], high[kChannels];
    std::fill_n(low, kChannels, 1e30f);
    std::fill_n(high, kChannels, -1e30f);
    samples.rectangle(p, tile.x, tile.y, tile.width, tile.height, colours);
    for (std::size_t i = 0; i < std::size_t{tile.width} * tile.height * kChannels; ++i) {
      low[i % kChannels] = std::min(low[i % kChannels], colours[i]);
      high[i % kChannels] = std::max(high[i % kChannels], colours[i]);
    }
    EmBox box{};
    box.half[0] = 0.5f * static_cast<float>(tile.width - 1);
    box.half[1] = 0.5f * static_cast<float>(tile.height - 1);
    box.middle[0] = static_cast<float>(tile.x) + 0.5f + box.half[0];
    box.middle[1] = static_cast<float>(tile.y) + 0.5f + box.half[1];
    for (std::size_t c = 0; c < kChannels; ++c) {
      box.middle[2 + c] = 0.5f * (low[c] + high[c]);
      box.half[2 + c] = 0.5f * (high[c] - low[c]);
    }
    const std::size_t count = em_select(field, samples, pair, box, pass.reach, r);
    const std::size_t padded = (count + kGmPad - 1) / kGmPad * kGmPad;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::size_t n = axis == 0 ? tile.width : tile.height;
      for (std::size_t i = 0; i < n; ++i) {
        const float at = static_cast<float>((axis == 0 ? tile.x : tile.y) + i) + 0.5f;
        float* way = r.way + (axis * kEmTile + i) * r.stride;
        float* distance = r.distance + (axis * kEmTile + i) * r.stride;
        for (std::size_t m = 0; m < padded; m += hn::Lanes(d)) {
          GmVec t = hn::Sub(hn::Set(d, at), hn::LoadU(d, r.list + (kEmMean + axis) * r.stride + m));
          if (samples.wraps) {
            t = gm_short(d, t, static_cast<float>(axis == 0 ? samples.width : samples.height));
          }
          hn::StoreU(t, d, way + m);
          hn::StoreU(hn::Mul(hn::Mul(t, t), hn::LoadU(d, r.list + (kEmScale + axis) * r.stride + m)), d,
                     distance + m);
        }
        std::fill_n((axis == 0 ? r.columns : r.rows) + i * r.stride, padded, 0.0f);
      }
    }
    for (std::size_t k = 0; k < kEmMoments; ++k) std::fill_n(r.moments + k * r.stride, padded, 0.0f);
    double log2_sum = 0;
    const float* colour = colours;
    for (std::size_t j = 0; j < tile.height; ++j) {
      for (std::size_t m = 0; m < padded; m += hn::Lanes(d)) {
        hn::StoreU(hn::Sub(hn::LoadU(d, r.list + kEmBase * r.stride + m),
                           hn::LoadU(d, r.distance + (kEmTile + j) * r.stride + m)),
                   d, r.row_base + m);
      }
      for (std::size_t i = 0; i < tile.width; ++i, colour += kChannels) {
        log2_sum += em_texel<kChannels>(r, padded, colour, samples.weights[p], i, j);
      }
    }
    em_axes(r, padded, tile);
    em_add(field, r, count, pair, sums);
    const std::uint64_t texels = std::uint64_t{tile.width} * tile.height;
    const double weight = double{samples.weights[p]};
    sums.log_likelihood += weight * (log2_sum * 0.6931471805599453);
    sums.weight += weight * static_cast<double>(texels);
    sums.samples += texels;
    sums.listed += texels * count;
  }
}

void em_tile_target(const EmField& field, const GmSamples& samples, const EmTile& tile, const GmEmPass& pass,
                    EmScratch& scratch, GmEmSums& sums) {
  if (field.channels == 1) em_tile<1>(field, samples, tile, pass, scratch, sums);
  if (field.channels == 2) em_tile<2>(field, samples, tile, pass, scratch, sums);
  if (field.channels == 3) em_tile<3>(field, samples, tile, pass, scratch, sums);
  if (field.channels == 4) em_tile<4>(field, samples, tile, pass, scratch, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

namespace btfc {

HWY_EXPORT(em_tile_target);

namespace {

// Partial sums of a pass; fixed, so that threads do not change a bit.
constexpr std::size_t kEmChunks = 16;

// ln of the peak of a component's density, without its weight.
double peak(const GmEmMixture& mixture, std::size_t m) {
  double log = 0;
  for (std::uint32_t n = 0; n < mixture.dimensions(); ++n) {
    log -= std::log(mixture.spread[std::size_t{n} * mixture.components + m]) +
           0.5 * std::log(2 * std::numbers::pi);
  }
  return log;
}

EmField em_field(const GmEmMixture& mixture) {
  EmField f;
  f.components = mixture.components;
  f.stride = (mixture.components + kGmPad - 1) / kGmPad * kGmPad;
  f.channels = mixture.channels;
  f.mean.assign(std::size_t{f.stride} * mixture.dimensions(), 0.0f);
  f.scale = f.mean;
  f.height.assign(f.stride, GM_NEVER);
  for (std::size_t m = 0; m < mixture.components; ++m) {
    if (mixture.weight[m] > 0) {
      f.height[m] =
          static_cast<float>((std::log(mixture.weight[m]) + peak(mixture, m)) * std::numbers::log2e);
    }
    for (std::uint32_t n = 0; n < mixture.dimensions(); ++n) {
      const double spread = mixture.spread[std::size_t{n} * mixture.components + m];
      f.mean[n * f.stride + m] = static_cast<float>(mixture.mean[std::size_t{n} * mixture.components + m]);
      f.scale[n * f.stride + m] = static_cast<float>(0.5 * std::numbers::log2e / (spread * spread));
    }
  }
  return f;
}

}  // namespace

GmEmSums gm_em_pass(const GmSamples& samples, const GmEmMixture& mixture, const GmEmPass& pass) {
  const EmField field = em_field(mixture);
  std::vector<EmTile> tiles;
  for (std::uint32_t y = 0; y < samples.height; y += kEmTile) {
    for (std::uint32_t x = 0; x < samples.width; x += kEmTile) {
      tiles.push_back({x, y, std::min(kEmTile, samples.width - x), std::min(kEmTile, samples.height - y)});
    }
  }
  std::vector<GmEmSums> parts(kEmChunks);
  tbb::parallel_for(std::size_t{0}, kEmChunks, [&](std::size_t c) {
    EmScratch scratch;
    parts[c].clear(mixture.components, mixture.dimensions());
    for (std::size_t t = c; t < tiles.size(); t += kEmChunks) {
      HWY_DYNAMIC_DISPATCH(em_tile_target)(field, samples, tiles[t], pass, scratch, parts[c]);
    }
  });
  for (std::size_t c = 1; c < kEmChunks; ++c) parts[0].add(parts[c]);
  // The moments are about the means as the vectors saw them, in single precision.
  GmEmSums& sums = parts[0];
  for (std::uint32_t n = 0; n < mixture.dimensions(); ++n) {
    for (std::size_t m = 0; m < mixture.components; ++m) {
      const std::size_t at = std::size_t{n} * mixture.components + m;
      const double off = static_cast<double>(field.mean[n * field.stride + m]) - mixture.mean[at];
      sums.second[at] += 2 * off * sums.first[at] + off * off * sums.sum[m];
      sums.first[at] += off * sums.sum[m];
    }
  }
  return sums;
}

GmEmSums gm_em_pass_plain(const GmSamples& samples, const GmEmMixture& mixture, std::uint32_t first_pair,
                          std::uint32_t pair_count) {
  const std::size_t components = mixture.components, dims = mixture.dimensions();
  GmEmSums sums;
  sums.clear(mixture.components, mixture.dimensions());
  std::vector<double> density(components), way(components * dims), top(components);
  for (std::size_t m = 0; m < components; ++m) top[m] = std::log(mixture.weight[m]) + peak(mixture, m);
  for (std::size_t p = first_pair; p < first_pair + pair_count; ++p) {
    for (std::uint32_t y = 0; y < samples.height; ++y) {
      for (std::uint32_t x = 0; x < samples.width; ++x) {
        double in[kGmMostDims] = {x + 0.5, y + 0.5};
        for (std::size_t n = 0; n < 4; ++n) in[2 + n] = static_cast<double>(samples.pairs[p].angle[n]);
        for (std::uint32_t c = 0; c < samples.channels; ++c) {
          in[kGmInputs + c] = static_cast<double>(samples.value(p, x, y, c)) -
                              static_cast<double>(samples.mean[p * samples.channels + c]);
        }
        double most = -1e300;
        for (std::size_t m = 0; m < components; ++m) {
          double l = top[m];
          for (std::size_t n = 0; n < dims; ++n) {
            double t = in[n] - mixture.mean[n * components + m];
            if (n < 2 && samples.wraps) {
              const double period = n == 0 ? samples.width : samples.height;
              t -= period * std::nearbyint(t / period);
            }
            way[m * dims + n] = t;
            const double spread = mixture.spread[n * components + m];
            l -= 0.5 * t * t / (spread * spread);
          }
          density[m] = l;
          most = std::max(most, l);
        }
        double total = 0;
        for (double& l : density) total += l = std::exp(l - most);
        const double weight = double{samples.weights[p]};
        sums.log_likelihood += weight * (most + std::log(total));
        sums.weight += weight;
        for (std::size_t m = 0; m < components; ++m) {
          const double q = weight * density[m] / total;
          sums.sum[m] += q;
          for (std::size_t n = 0; n < dims; ++n) {
            const double t = way[m * dims + n];
            sums.first[n * components + m] += q * t;
            sums.second[n * components + m] += q * t * t;
          }
        }
        ++sums.samples;
        sums.listed += components;
      }
    }
  }
  return sums;
}

}  // namespace btfc
#endif
