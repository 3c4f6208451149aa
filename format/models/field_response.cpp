// Responses by running the recursion on single impulses.
#include "format/models/field_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace btfc {
namespace {

// What an impulse of 1 in output g, factor f of a scalar model, makes of all outputs: d planes, or one.
std::vector<float> unit_response(const FieldBand& band, std::uint32_t subspace, std::uint32_t g) {
  const auto m = static_cast<std::ptrdiff_t>(band.margin);
  const std::ptrdiff_t width = 2 * m + 1;
  const std::size_t d = band.coupled() ? band.factors : 1;
  const std::size_t plane = static_cast<std::size_t>((m + 1) * width);
  const auto& offsets = band.neighbours(g);
  const float* record = band.numbers + std::size_t{subspace} * band.record;
  const float* a = band.coupled() ? record + d * (d + 1) / 2 : record + band.begins[g] + 1;
  std::vector<float> h(d * plane);
  for (std::ptrdiff_t y = 0; y <= m; ++y) {
    for (std::ptrdiff_t x = 0; x < width; ++x) {
      for (std::size_t f = 0; f < d; ++f) {
        float sum = y == 0 && x == m && (!band.coupled() || f == g) ? 1.0f : 0.0f;
        for (std::size_t s = 0; s < offsets.size(); ++s) {
          const std::ptrdiff_t from_x = x + offsets[s].dx, from_y = y + offsets[s].dy;
          if (from_x < 0 || from_x >= width || from_y < 0) continue;
          for (std::size_t e = 0; e < d; ++e)
            sum += a[(s * d + f) * d + e] * h[e * plane + static_cast<std::size_t>(from_y * width + from_x)];
        }
        h[f * plane + static_cast<std::size_t>(y * width + x)] = sum;
      }
    }
  }
  return h;
}

FieldDecay decay_of(const FieldBand& band, std::uint32_t subspace, std::uint32_t g,
                    const std::vector<float>& h) {
  const std::ptrdiff_t m = band.margin, width = 2 * m + 1;
  const std::ptrdiff_t plane = (m + 1) * width;
  FieldDecay decay;
  decay.rings.resize(static_cast<std::size_t>(m) + 1);
  decay.energy.resize(decay.rings.size());
  for (std::size_t i = 0; i < h.size(); ++i) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) % plane;
    const std::ptrdiff_t ring = std::max(at / width, std::abs(at % width - m));
    decay.rings[static_cast<std::size_t>(ring)] += std::fabs(double{h[i]});
    decay.energy[static_cast<std::size_t>(ring)] += double{h[i]} * double{h[i]};
  }
  const float* record = band.numbers + std::size_t{subspace} * band.record;
  const std::size_t d = band.coupled() ? band.factors : 1;
  const float* a = band.coupled() ? record + d * (d + 1) / 2 : record + band.begins[g] + 1;
  for (std::size_t i = 0; i < band.neighbours(g).size() * d * d; ++i)
    decay.coefficients += std::fabs(double{a[i]});
  return decay;
}

Result<Done> check(const FieldBand& band, std::uint32_t subspace, std::uint32_t factor,
                   const FieldDecay& decay) {
  if (decay.whole() <= kMostResponse && decay.beyond() <= kMostBeyond) return Done{};
  return invalid(
      "FD6", 0,
      fmt::format("the recursion of subspace {}, factor {}, level {} does not die away within {} "
                  "texels: its impulse response sums to {:.4g}, {:.4g} beyond, expected at most {} and {}",
                  subspace, factor, band.level, band.margin, decay.whole(), decay.beyond(), kMostResponse,
                  kMostBeyond));
}

}  // namespace

Result<Done> field_responses(const FieldBand& band, std::uint32_t subspace, float* out) {
  const std::size_t d = band.factors;
  const std::size_t plane = (std::size_t{band.margin} + 1) * (2 * std::size_t{band.margin} + 1);
  const float* record = band.numbers + std::size_t{subspace} * band.record;
  if (!band.coupled()) {
    for (std::uint32_t f = 0; f < d; ++f) {
      std::vector<float> h = unit_response(band, subspace, f);
      if (const auto ok = check(band, subspace, f, decay_of(band, subspace, f, h)); !ok) return ok.error();
      const float spread = record[band.begins[f]];
      std::transform(h.begin(), h.end(), out + f * plane, [&](float v) { return spread * v; });
    }
    return Done{};
  }
  std::fill_n(out, d * d * plane, 0.0f);
  for (std::uint32_t e = 0; e < d; ++e) {
    const std::vector<float> h = unit_response(band, subspace, e);
    if (const auto ok = check(band, subspace, e, decay_of(band, subspace, e, h)); !ok) return ok.error();
    for (std::size_t f = 0; f < d; ++f) {
      for (std::size_t g = 0; g <= e; ++g) {
        const float factor = record[e * (e + 1) / 2 + g];
        float* to = out + (f * d + g) * plane;
        for (std::size_t i = 0; i < plane; ++i) to[i] += h[f * plane + i] * factor;
      }
    }
  }
  return Done{};
}

double FieldDecay::whole() const { return std::accumulate(rings.begin(), rings.end(), 0.0); }

double FieldDecay::beyond() const {
  return (1 + coefficients) *
         std::accumulate(rings.end() - std::min<std::ptrdiff_t>(4, std::ssize(rings)), rings.end(), 0.0);
}

FieldDecay field_decay(const FieldBand& band, std::uint32_t subspace, std::uint32_t g) {
  return decay_of(band, subspace, g, unit_response(band, subspace, g));
}

}  // namespace btfc
