// A wavefront: a vector holds as many rows, each kSkew texels behind the row above it, so that all that a
// texel needs of the rows above is there when it is its turn.
#include "format/models/field_synthesis.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "format/models/field_synthesis.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 16>;

// The farthest neighbour lies 4 to the right, one row above: it must be done, and stored long enough to be
// read back without waiting.
constexpr std::ptrdiff_t kSkew = 8;
constexpr std::ptrdiff_t kRowsAbove = 4;  // of the rows before a group, the last ones are kept
constexpr std::ptrdiff_t kBefore = kSkew * kRowsAbove + 4;

// A group of rows, skewed: the value of row r, column i lies at time i + kSkew r; rows -4 … -1 are those
// before the group.
struct Skewed {
  std::ptrdiff_t lanes, columns;
  std::ptrdiff_t stride() const { return lanes + kRowsAbove; }
  std::ptrdiff_t times() const { return columns + kSkew * (lanes - 1); }
  std::size_t floats() const {
    return static_cast<std::size_t>((kBefore + times() + kSkew * lanes) * stride());
  }
  std::ptrdiff_t at(std::ptrdiff_t time, std::ptrdiff_t row) const {
    return (kBefore + time) * stride() + kRowsAbove + row;
  }
};

using Signed = hn::Rebind<std::int32_t, Lanes>;
using Unsigned = hn::Rebind<std::uint32_t, Lanes>;

// The noise of a group of rows, by times. places: the columns' places, with kSkew lanes more before and
// behind.
HWY_INLINE void noise_group(const Skewed& s, const std::uint32_t* places, hn::Vec<Unsigned> ys,
                            std::uint32_t stream, float* out) {
  const Lanes d;
  const Unsigned du;
  const Signed di;
  const auto mul = hn::Set(du, 1664525u), add = hn::Set(du, 1013904223u);
  const auto y0 = hn::Add(hn::Mul(ys, mul), add), z0 = hn::Set(du, stream * 1664525u + 1013904223u);
  const auto first = hn::Add(hn::Mul(y0, z0), add);
  const auto behind = hn::Mul(hn::Iota(di, 0), hn::Set(di, -static_cast<std::int32_t>(kSkew)));
  for (std::ptrdiff_t t = 0; t < s.times(); ++t) {
    const auto x = hn::GatherIndex(du, places + t, behind);
    auto a = hn::Add(hn::Mul(x, mul), first);
    auto b = hn::Add(y0, hn::Mul(z0, a));
    auto c = hn::Add(z0, hn::Mul(a, b));
    a = hn::Xor(a, hn::ShiftRight<16>(a));
    b = hn::Xor(b, hn::ShiftRight<16>(b));
    c = hn::Xor(c, hn::ShiftRight<16>(c));
    a = hn::Add(a, hn::Mul(b, c));
    b = hn::Add(b, hn::Mul(c, a));
    const auto bits = hn::ShiftLeft<16>(
        hn::PopulationCount(hn::Mul(hn::Xor(a, hn::ShiftRight<16>(a)), hn::Set(du, 0x85ebca6bu))));
    const auto triangle = hn::Add(hn::ShiftRight<16>(b), hn::And(b, hn::Set(du, 0xffffu)));
    const auto e = hn::Sub(hn::BitCast(di, hn::Add(bits, triangle)), hn::Set(di, 1114111));
    hn::StoreU(hn::Mul(hn::ConvertTo(d, e), hn::Set(d, FIELD_NOISE_UNIT)), d, out + t * s.lanes);
  }
}

// Outputs that have the same neighbours: term n of output o is coefficient[n * outputs + o] times the value
// step[n] floats away from where the output goes. Noises come first, from rows of their own.
struct Sums {
  std::vector<const float*> noises;
  std::vector<std::ptrdiff_t> steps;
  std::vector<float> factors, coefficients;
  std::vector<float*> outs;  // of time 0
};

// kOutputs of them from `first` on. Terms go round four partial sums (spec/models/car.md section 5.2).
template <std::size_t kOutputs, bool kMasked>
HWY_INLINE void run_sums(const Skewed& s, const Sums& sums, std::size_t first, std::ptrdiff_t begin,
                         std::ptrdiff_t end) {
  const Lanes d;
  const Signed di;
  const std::ptrdiff_t stride = s.stride();
  const auto behind = hn::Mul(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(kSkew)));
  const auto columns = hn::Set(di, static_cast<std::int32_t>(s.columns));
  const std::size_t outputs = sums.outs.size(), noises = sums.noises.size(), terms = sums.steps.size();
  const float* factors = sums.factors.data() + first;
  // Of order 0 there are no coefficients, and none are read: but then there is no array to point into.
  const float* coefficients = terms == 0 ? factors : sums.coefficients.data() + first;
  float* out[kOutputs];
  for (std::size_t o = 0; o < kOutputs; ++o) out[o] = sums.outs[first + o] + begin * stride;
  for (std::ptrdiff_t t = begin; t < end; ++t) {
    hn::Vec<Lanes> a[kOutputs], b[kOutputs], c[kOutputs], e[kOutputs];
    for (std::size_t o = 0; o < kOutputs; ++o) {
      a[o] = hn::Mul(hn::Set(d, factors[o]), hn::LoadU(d, sums.noises[0] + t * s.lanes));
      b[o] = c[o] = e[o] = hn::Zero(d);
    }
    for (std::size_t n = 1; n < noises; ++n) {
      const auto noise = hn::LoadU(d, sums.noises[n] + t * s.lanes);
      for (std::size_t o = 0; o < kOutputs; ++o)
        a[o] = hn::Add(a[o], hn::Mul(hn::Set(d, factors[n * outputs + o]), noise));
    }
    std::size_t n = 0;
    for (; n + 4 <= terms; n += 4) {
      const float* k = coefficients + n * outputs;
      const std::ptrdiff_t* step = &sums.steps[n];
      for (std::size_t o = 0; o < kOutputs; ++o) {
        a[o] = hn::Add(a[o], hn::Mul(hn::Set(d, k[o]), hn::LoadU(d, out[o] + step[0])));
        b[o] = hn::Add(b[o], hn::Mul(hn::Set(d, k[outputs + o]), hn::LoadU(d, out[o] + step[1])));
        c[o] = hn::Add(c[o], hn::Mul(hn::Set(d, k[2 * outputs + o]), hn::LoadU(d, out[o] + step[2])));
        e[o] = hn::Add(e[o], hn::Mul(hn::Set(d, k[3 * outputs + o]), hn::LoadU(d, out[o] + step[3])));
      }
    }
    for (std::size_t o = 0; o < kOutputs; ++o) {
      const float* k = coefficients + n * outputs + o;
      if (n < terms) a[o] = hn::Add(a[o], hn::Mul(hn::Set(d, k[0]), hn::LoadU(d, out[o] + sums.steps[n])));
      if (n + 1 < terms)
        b[o] = hn::Add(b[o], hn::Mul(hn::Set(d, k[outputs]), hn::LoadU(d, out[o] + sums.steps[n + 1])));
      if (n + 2 < terms)
        c[o] = hn::Add(c[o], hn::Mul(hn::Set(d, k[2 * outputs]), hn::LoadU(d, out[o] + sums.steps[n + 2])));
      auto v = hn::Add(hn::Add(a[o], b[o]), hn::Add(c[o], e[o]));
      if constexpr (kMasked) {
        const auto i = hn::Sub(hn::Set(di, static_cast<std::int32_t>(t)), behind);
        const auto inside = hn::And(hn::Gt(i, hn::Set(di, -1)), hn::Lt(i, columns));
        v = hn::IfThenElseZero(hn::RebindMask(d, inside), v);
      }
      hn::StoreU(v, d, out[o]);
      out[o] += stride;
    }
  }
}

// As many outputs at once as registers allow.
template <bool kMasked>
HWY_INLINE void run_all(const Skewed& s, const Sums& sums, std::ptrdiff_t begin, std::ptrdiff_t end) {
  std::size_t first = 0;
  for (; first + 4 <= sums.outs.size(); first += 4) run_sums<4, kMasked>(s, sums, first, begin, end);
  for (; first + 2 <= sums.outs.size(); first += 2) run_sums<2, kMasked>(s, sums, first, begin, end);
  if (first < sums.outs.size()) run_sums<1, kMasked>(s, sums, first, begin, end);
}

// Outputs that depend on one another go through each time together.
HWY_INLINE void run_coupled(const Skewed& s, const std::vector<Sums>& outputs, std::ptrdiff_t begin,
                            std::ptrdiff_t end, bool masked) {
  for (std::ptrdiff_t t = begin; t < end; ++t) {
    for (const Sums& sums : outputs) {
      if (masked) {
        run_sums<1, true>(s, sums, 0, t, t + 1);
      } else {
        run_sums<1, false>(s, sums, 0, t, t + 1);
      }
    }
  }
}

// All buffers of a call: subspace by subspace, factor by factor.
struct Buffers {
  Skewed s;
  std::size_t factors;
  std::vector<float> values;
  float* at(std::size_t k, std::size_t f) { return values.data() + (k * factors + f) * s.floats(); }
};

std::vector<Sums> scalar_sums(const FieldBand& band, std::span<const std::uint32_t> subspaces,
                              Buffers& buffers, const std::vector<const float*>& noises) {
  std::vector<Sums> all;
  for (std::size_t f = 0; f < band.factors; ++f) {
    Sums sums;
    const auto& offsets = band.neighbours(static_cast<std::uint32_t>(f));
    sums.noises = {noises[f]};
    const Skewed& s = buffers.s;
    for (const FieldOffset o : offsets) sums.steps.push_back(s.at(o.dx + kSkew * o.dy, o.dy) - s.at(0, 0));
    sums.coefficients.resize(offsets.size() * subspaces.size());
    for (std::size_t k = 0; k < subspaces.size(); ++k) {
      const float* numbers = band.numbers + std::size_t{subspaces[k]} * band.record + band.begins[f];
      sums.factors.push_back(numbers[0]);
      for (std::size_t n = 0; n < offsets.size(); ++n)
        sums.coefficients[n * subspaces.size() + k] = numbers[1 + n];
      sums.outs.push_back(buffers.at(k, f) + s.at(0, 0));
    }
    all.push_back(std::move(sums));
  }
  return all;
}

std::vector<Sums> coupled_sums(const FieldBand& band, std::uint32_t subspace, std::size_t k, Buffers& buffers,
                               const std::vector<const float*>& noises) {
  const std::size_t d = band.factors;
  const float* record = band.numbers + std::size_t{subspace} * band.record;
  const auto& offsets = band.neighbours(0);
  const Skewed& s = buffers.s;
  std::vector<Sums> all;
  for (std::size_t f = 0; f < d; ++f) {
    Sums sums;
    for (std::size_t g = 0; g <= f; ++g) {
      sums.noises.push_back(noises[g]);
      sums.factors.push_back(record[f * (f + 1) / 2 + g]);
    }
    const float* a = record + d * (d + 1) / 2;
    for (std::size_t n = 0; n < offsets.size(); ++n) {
      for (std::size_t g = 0; g < d; ++g) {
        const FieldOffset o = offsets[n];
        sums.steps.push_back(buffers.at(k, g) - buffers.at(k, f) + s.at(o.dx + kSkew * o.dy, o.dy) -
                             s.at(0, 0));
        sums.coefficients.push_back(a[(n * d + f) * d + g]);
      }
    }
    sums.outs = {buffers.at(k, f) + s.at(0, 0)};
    all.push_back(std::move(sums));
  }
  return all;
}

// Rows of a group that are wanted -> an image. Four times of four rows are turned over at once.
HWY_INLINE void copy_out(const Skewed& s, const float* buffer, std::ptrdiff_t margin,
                         std::ptrdiff_t first_row, std::ptrdiff_t end_row, const FieldWindow& window,
                         float* out) {
  static_assert(kSkew % 4 == 0);
  const auto width = static_cast<std::ptrdiff_t>(window.width);
#if HWY_TARGET == HWY_SCALAR
  for (std::ptrdiff_t r = first_row; r < end_row; ++r) {
    for (std::ptrdiff_t x = 0; x < width; ++x)
      out[(r - first_row) * width + x] = buffer[s.at(margin + x + kSkew * r, r)];
  }
#else
  const Lanes d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const hn::Repartition<double, Lanes> d2;
  HWY_ALIGN float turned[4 * hn::MaxLanes(Lanes())];
  for (std::ptrdiff_t time = 0; time < width + kSkew * (end_row - 1); time += 4) {
    const float* from = buffer + s.at(margin + time, 0);
    const auto v0 = hn::LoadU(d, from), v1 = hn::LoadU(d, from + s.stride()),
               v2 = hn::LoadU(d, from + 2 * s.stride()), v3 = hn::LoadU(d, from + 3 * s.stride());
    const auto low01 = hn::BitCast(d2, hn::InterleaveLower(d, v0, v1)),
               low23 = hn::BitCast(d2, hn::InterleaveLower(d, v2, v3));
    const auto high01 = hn::BitCast(d2, hn::InterleaveUpper(d, v0, v1)),
               high23 = hn::BitCast(d2, hn::InterleaveUpper(d, v2, v3));
    hn::Store(hn::BitCast(d, hn::InterleaveLower(d2, low01, low23)), d, turned);
    hn::Store(hn::BitCast(d, hn::InterleaveUpper(d2, low01, low23)), d, turned + lanes);
    hn::Store(hn::BitCast(d, hn::InterleaveLower(d2, high01, high23)), d, turned + 2 * lanes);
    hn::Store(hn::BitCast(d, hn::InterleaveUpper(d2, high01, high23)), d, turned + 3 * lanes);
    // Row r's four texels lie in block r / 4 of vector r % 4; rows that are not yet or no longer within the
    // window's columns are passed over.
    const std::ptrdiff_t begin = std::max(first_row, (time - width + kSkew) / kSkew);
    const std::ptrdiff_t end = std::min(end_row, time / kSkew + 1);
    for (std::ptrdiff_t r = begin; r < end; ++r) {
      const std::ptrdiff_t x = time - kSkew * r;
      const float* own = turned + r % 4 * lanes + r / 4 * 4;
      float* to = out + (r - first_row) * width + x;
      if (x + 4 <= width) {
        std::memcpy(to, own, 4 * sizeof(float));
      } else {
        for (std::ptrdiff_t i = 0; i < width - x; ++i) to[i] = own[i];
      }
    }
  }
#endif
}

void synthesise_target(const FieldBand& band, std::span<const std::uint32_t> subspaces,
                       const FieldWindow& window, float* out) {
  const Lanes tag;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
  const auto margin = static_cast<std::ptrdiff_t>(band.margin);
  const Skewed s{lanes, static_cast<std::ptrdiff_t>(window.width) + 2 * margin};
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(window.height) + margin;
  const std::size_t d = band.factors, count = subspaces.size();
  // Lanes behind and before the columns read places too, whose values are masked.
  const std::ptrdiff_t ramp = kSkew * (lanes - 1);
  const auto xs = field_places(window.x - margin - ramp, static_cast<std::size_t>(s.columns + 2 * ramp),
                               band.level, band.period);
  auto ys = field_places(window.y - margin, static_cast<std::size_t>(rows), band.level, band.period);
  ys.resize(ys.size() + static_cast<std::size_t>(lanes));

  Buffers buffers{s, d, std::vector<float>(count * d * s.floats())};
  const std::size_t noise_floats = static_cast<std::size_t>(s.times() * lanes);
  std::vector<float> noise(d * noise_floats);
  std::vector<const float*> noises;
  for (std::size_t f = 0; f < d; ++f) noises.push_back(noise.data() + f * noise_floats);
  const std::vector<Sums> scalar =
      band.coupled() ? std::vector<Sums>() : scalar_sums(band, subspaces, buffers, noises);
  std::vector<std::vector<Sums>> coupled;
  for (std::size_t k = 0; k < count && band.coupled(); ++k)
    coupled.push_back(coupled_sums(band, subspaces[k], k, buffers, noises));

  // Times at which all lanes lie within the columns: [ramp, steady), where there are any.
  const std::ptrdiff_t rising = std::min(ramp, s.times()), steady = std::max(rising, s.columns);
  for (std::ptrdiff_t first = 0; first < rows; first += lanes) {
    for (std::size_t f = 0; f < d; ++f) {
      noise_group(s, xs.data() + ramp, hn::LoadU(Unsigned(), ys.data() + first),
                  field_stream(band.seed, band.level, static_cast<std::uint32_t>(f)),
                  noise.data() + f * noise_floats);
    }
    for (const Sums& sums : scalar) {
      run_all<true>(s, sums, 0, rising);
      run_all<false>(s, sums, rising, steady);
      run_all<true>(s, sums, steady, s.times());
    }
    for (const std::vector<Sums>& sums : coupled) {
      run_coupled(s, sums, 0, rising, true);
      run_coupled(s, sums, rising, steady, false);
      run_coupled(s, sums, steady, s.times(), true);
    }
    const std::ptrdiff_t from_row = std::clamp<std::ptrdiff_t>(margin - first, 0, lanes);
    const std::ptrdiff_t end_row = std::min(lanes, rows - first);
    for (std::size_t b = 0; b < count * d; ++b) {
      float* buffer = buffers.values.data() + b * s.floats();
      if (from_row < end_row) {
        copy_out(
            s, buffer, margin, from_row, end_row, window,
            out + b * window.texels() + static_cast<std::size_t>(first + from_row - margin) * window.width);
      }
      // The group's last rows become those before the next one. Rows farther up first: with few lanes they
      // move within the same places.
      for (std::ptrdiff_t time = -kSkew * kRowsAbove; time < s.columns; ++time) {
        float* to = buffer + s.at(time, -kRowsAbove);
        const float* from = buffer + s.at(time + kSkew * lanes, lanes - kRowsAbove);
        for (std::ptrdiff_t k = 0; k < kRowsAbove; ++k) to[k] = from[k];
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(synthesise_target);

void field_synthesise(const FieldBand& band, std::span<const std::uint32_t> subspaces,
                      const FieldWindow& window, float* out) {
  HWY_DYNAMIC_DISPATCH(synthesise_target)(band, subspaces, window, out);
}

}  // namespace btfc
#endif
