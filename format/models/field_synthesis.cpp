// A wavefront: a vector holds as many rows, each kSkew texels behind the row above it, so that all that a
// texel needs of the rows above is there when it is its turn.
#include "format/models/field_synthesis.h"

#include <algorithm>
#include <cstddef>
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
  std::size_t floats() const { return static_cast<std::size_t>((kBefore + times() + kSkew * lanes) * stride()); }
  std::ptrdiff_t at(std::ptrdiff_t time, std::ptrdiff_t row) const {
    return (kBefore + time) * stride() + kRowsAbove + row;
  }
};

// One row of noise.
HWY_INLINE void noise_row(const std::uint32_t* xs, std::size_t count, std::uint32_t y, std::uint32_t stream,
                          float* out) {
  const Lanes d;
  const hn::Rebind<std::uint32_t, Lanes> du;
  const hn::Rebind<std::int32_t, Lanes> di;
  const auto mul = hn::Set(du, 1664525u), add = hn::Set(du, 1013904223u);
  const auto y0 = hn::Set(du, y * 1664525u + 1013904223u), z0 = hn::Set(du, stream * 1664525u + 1013904223u);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    auto a = hn::Add(hn::Mul(hn::LoadU(du, xs + i), mul), add);
    a = hn::Add(a, hn::Mul(y0, z0));
    auto b = hn::Add(y0, hn::Mul(z0, a));
    auto c = hn::Add(z0, hn::Mul(a, b));
    a = hn::Xor(a, hn::ShiftRight<16>(a));
    b = hn::Xor(b, hn::ShiftRight<16>(b));
    c = hn::Xor(c, hn::ShiftRight<16>(c));
    a = hn::Add(a, hn::Mul(b, c));
    b = hn::Add(b, hn::Mul(c, a));
    const auto bits = hn::ShiftLeft<16>(hn::PopulationCount(a));
    const auto triangle = hn::Add(hn::ShiftRight<16>(b), hn::And(b, hn::Set(du, 0xffffu)));
    const auto e = hn::Sub(hn::BitCast(di, hn::Add(bits, triangle)), hn::Set(di, 1114111));
    hn::StoreU(hn::Mul(hn::ConvertTo(d, e), hn::Set(d, FIELD_NOISE_UNIT)), d, out + i);
  }
}

// What one output adds up: noises with their factors, then neighbours with their coefficients.
struct Sum {
  std::vector<std::pair<const float*, float>> noises;            // by time, lanes together
  std::vector<std::pair<const float*, float>> terms;  // where time 0 of the neighbour lies
  float* out;
};

HWY_INLINE void run_times(const Skewed& s, const std::vector<Sum>& sums, std::ptrdiff_t begin, std::ptrdiff_t end,
                          bool masked) {
  const Lanes d;
  const std::ptrdiff_t stride = s.stride();
  const hn::Rebind<std::int32_t, Lanes> di;
  const auto behind = hn::Mul(hn::Iota(di, 0), hn::Set(di, static_cast<std::int32_t>(kSkew)));
  const auto columns = hn::Set(di, static_cast<std::int32_t>(s.columns));
  for (std::ptrdiff_t t = begin; t < end; ++t) {
    for (const Sum& sum : sums) {
      auto v = hn::Zero(d);
      bool first = true;
      for (const auto& [noise, factor] : sum.noises) {
        const auto e = hn::Mul(hn::Set(d, factor), hn::LoadU(d, noise + t * s.lanes));
        v = first ? e : hn::Add(v, e);
        first = false;
      }
      for (const auto& [from, a] : sum.terms) v = hn::Add(v, hn::Mul(hn::Set(d, a), hn::LoadU(d, from + t * stride)));
      if (masked) {
        const auto i = hn::Sub(hn::Set(di, static_cast<std::int32_t>(t)), behind);
        const auto inside = hn::And(hn::Gt(i, hn::Set(di, -1)), hn::Lt(i, columns));
        v = hn::IfThenElseZero(hn::RebindMask(d, inside), v);
      }
      hn::StoreU(v, d, sum.out + t * stride);
    }
  }
}

void synthesise_target(const FieldBand& band, std::span<const std::uint32_t> subspaces, const FieldWindow& window,
                       float* out) {
  const Lanes tag;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
  const auto margin = static_cast<std::ptrdiff_t>(band.margin);
  const Skewed s{lanes, static_cast<std::ptrdiff_t>(window.width) + 2 * margin};
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(window.height) + margin;
  const std::size_t d = band.factors, count = subspaces.size();
  auto xs = field_places(window.x - margin, static_cast<std::size_t>(s.columns), band.level, band.period);
  xs.resize(xs.size() + static_cast<std::size_t>(lanes));
  const auto ys = field_places(window.y - margin, static_cast<std::size_t>(rows), band.level, band.period);

  std::vector<float> values(count * d * s.floats());
  const std::size_t noise_floats = static_cast<std::size_t>(s.times() * lanes);
  std::vector<float> noise(d * noise_floats), row(xs.size());
  // The sums of each subspace: a list of one output, or of all outputs that depend on one another.
  std::vector<std::vector<Sum>> lists;
  for (std::size_t k = 0; k < count; ++k) {
    const float* record = band.numbers + std::size_t{subspaces[k]} * band.record;
    if (band.coupled()) lists.emplace_back();
    for (std::size_t f = 0; f < d; ++f) {
      if (!band.coupled()) lists.emplace_back();
      Sum sum;
      const auto buffer = [&](std::size_t g) { return values.data() + (k * d + g) * s.floats(); };
      sum.out = buffer(f) + s.at(0, 0);
      const auto& offsets = band.neighbours(static_cast<std::uint32_t>(f));
      const auto from = [&](std::size_t g, FieldOffset o) {
        return buffer(g) + s.at(o.dx + kSkew * o.dy, o.dy);
      };
      if (band.coupled()) {
        for (std::size_t g = 0; g <= f; ++g)
          sum.noises.emplace_back(noise.data() + g * noise_floats, record[f * (f + 1) / 2 + g]);
        const float* a = record + d * (d + 1) / 2;
        for (std::size_t n = 0; n < offsets.size(); ++n) {
          for (std::size_t g = 0; g < d; ++g) sum.terms.emplace_back(from(g, offsets[n]), a[(n * d + f) * d + g]);
        }
      } else {
        const float* numbers = record + band.begins[f];
        sum.noises.emplace_back(noise.data() + f * noise_floats, numbers[0]);
        for (std::size_t n = 0; n < offsets.size(); ++n) sum.terms.emplace_back(from(f, offsets[n]), numbers[1 + n]);
      }
      lists.back().push_back(std::move(sum));
    }
  }

  for (std::ptrdiff_t first = 0; first < rows; first += lanes) {
    for (std::size_t f = 0; f < d; ++f) {
      const std::uint32_t stream = field_stream(band.seed, band.level, static_cast<std::uint32_t>(f));
      for (std::ptrdiff_t r = 0; r < lanes && first + r < rows; ++r) {
        noise_row(xs.data(), static_cast<std::size_t>(s.columns), ys[static_cast<std::size_t>(first + r)], stream,
                  row.data());
        float* to = noise.data() + f * noise_floats + r + kSkew * r * lanes;
        for (std::ptrdiff_t i = 0; i < s.columns; ++i) to[i * lanes] = row[static_cast<std::size_t>(i)];
      }
    }
    const std::ptrdiff_t ramp = std::min(kSkew * (lanes - 1), s.times());
    const std::ptrdiff_t steady = std::max(ramp, s.columns);
    for (const std::vector<Sum>& sums : lists) {
      run_times(s, sums, 0, ramp, true);
      run_times(s, sums, ramp, steady, ramp > s.columns);
      run_times(s, sums, steady, s.times(), true);
    }
    for (std::size_t b = 0; b < count * d; ++b) {
      float* buffer = values.data() + b * s.floats();
      for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(0, margin - first); r < lanes && first + r < rows; ++r) {
        float* to = out + b * window.texels() + static_cast<std::size_t>(first + r - margin) * window.width;
        const float* from = buffer + s.at(margin + kSkew * r, r);
        for (std::uint32_t x = 0; x < window.width; ++x) to[x] = from[static_cast<std::ptrdiff_t>(x) * s.stride()];
      }
      // The group's last rows become those before the next one. Rows farther up first: with few lanes they
      // move within the same places.
      for (std::ptrdiff_t time = -kSkew * kRowsAbove; time < s.columns; ++time) {
        for (std::ptrdiff_t k = kRowsAbove; k >= 1; --k)
          buffer[s.at(time, -k)] = buffer[s.at(time + kSkew * lanes, lanes - k)];
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

void field_synthesise(const FieldBand& band, std::span<const std::uint32_t> subspaces, const FieldWindow& window,
                      float* out) {
  HWY_DYNAMIC_DISPATCH(synthesise_target)(band, subspaces, window, out);
}

}  // namespace btfc
#endif
