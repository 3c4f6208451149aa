// Model gm, format layer: rounding, codes and sizes.
#include "format/models/gm_payload.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "shaders/btfc_half.h"

namespace btfc {
namespace {

constexpr float kLargestHalf = 65504.0f;

std::uint32_t bits_of(GmPrecision precision) {
  return precision == GmPrecision::f32 ? 32 : precision == GmPrecision::f16 ? 16 : 8;
}

std::uint32_t code_u8(float value, const GmRange& range) {
  if (!(range.high > range.low)) return 0;
  const float scaled = (value - range.low) / (range.high - range.low) * 255.0f;
  return static_cast<std::uint32_t>(std::clamp(std::nearbyint(scaled), 0.0f, 255.0f));
}

float value_u8(std::uint32_t code, const GmRange& range) {
  return range.low + static_cast<float>(code) * ((range.high - range.low) / 255.0f);
}

std::uint32_t code_f16(float value) {
  return btfc_float_to_half(std::clamp(value, -kLargestHalf, kLargestHalf));
}

}  // namespace

GmMixture gm_make_mixture(const GmShape& shape) {
  return {shape, std::vector<float>(std::size_t{shape.rows()} * shape.components)};
}

std::vector<GmRange> gm_ranges(const GmMixture& mixture) {
  std::vector<GmRange> ranges(mixture.shape.rows());
  for (std::uint32_t r = 0; r < ranges.size(); ++r) {
    const auto row = mixture.row(r);
    if (row.empty()) continue;
    const auto [low, high] = std::minmax_element(row.begin(), row.end());
    ranges[r] = {*low, *high};
  }
  return ranges;
}

float gm_rounded(float value, GmPrecision precision, const GmRange& range) {
  if (precision == GmPrecision::f32) return value;
  if (precision == GmPrecision::f16) return btfc_half_to_float(code_f16(value));
  return value_u8(code_u8(value, range), range);
}

GmCodes gm_quantise(const GmMixture& mixture, GmPrecision precision, std::span<const GmRange> ranges) {
  GmCodes codes;
  codes.shape = mixture.shape;
  codes.precision = precision;
  const std::size_t bytes = bits_of(precision) / 8;
  codes.bytes.resize(mixture.values.size() * bytes);
  if (precision == GmPrecision::u8) codes.ranges.assign(ranges.begin(), ranges.end());
  for (std::size_t i = 0; i < mixture.values.size(); ++i) {
    std::uint32_t code = 0;
    if (precision == GmPrecision::f32) {
      std::memcpy(&code, &mixture.values[i], 4);
    } else if (precision == GmPrecision::f16) {
      code = code_f16(mixture.values[i]);
    } else {
      code = code_u8(mixture.values[i], ranges[i / mixture.shape.components]);
    }
    for (std::size_t b = 0; b < bytes; ++b) {
      codes.bytes[i * bytes + b] = static_cast<std::uint8_t>(code >> (8 * b));
    }
  }
  return codes;
}

GmMixture gm_dequantise(const GmCodes& codes) {
  GmMixture mixture = gm_make_mixture(codes.shape);
  const std::size_t bytes = bits_of(codes.precision) / 8;
  for (std::size_t i = 0; i < mixture.values.size(); ++i) {
    std::uint32_t code = 0;
    for (std::size_t b = 0; b < bytes; ++b) code |= std::uint32_t{codes.bytes[i * bytes + b]} << (8 * b);
    if (codes.precision == GmPrecision::f32) {
      std::memcpy(&mixture.values[i], &code, 4);
    } else if (codes.precision == GmPrecision::f16) {
      mixture.values[i] = btfc_half_to_float(code);
    } else {
      mixture.values[i] = value_u8(code, codes.ranges[i / codes.shape.components]);
    }
  }
  return mixture;
}

float gm_mean_value(const GmMean& mean, std::uint32_t pair, std::uint32_t view, std::uint32_t light,
                    std::uint32_t channel) {
  if (mean.form != GmMeanForm::coded) return mean.table[std::size_t{pair} * mean.channels + channel];
  float sum = 0;
  for (std::uint32_t k = 0; k < mean.rank; ++k) {
    const int product =
        int{mean.view_codes[std::size_t{k} * mean.views + view]} *
        int{mean.light_codes[(std::size_t{k} * mean.lights + light) * mean.channels + channel]};
    sum += mean.steps[k] * static_cast<float>(product);
  }
  return sum;
}

std::uint64_t gm_mixture_bits(const GmShape& shape, GmPrecision precision) {
  const std::uint64_t ranges = precision == GmPrecision::u8 ? std::uint64_t{64} * shape.rows() : 0;
  return std::uint64_t{shape.rows()} * shape.components * bits_of(precision) + ranges;
}

std::uint64_t gm_mean_bits(GmMeanForm form, std::uint32_t views, std::uint32_t lights, std::uint32_t pairs,
                           std::uint32_t channels, std::uint32_t rank) {
  if (form == GmMeanForm::f32) return std::uint64_t{32} * pairs * channels;
  if (form == GmMeanForm::u8) return std::uint64_t{8} * pairs * channels;
  return rank * (32 + 8 * (std::uint64_t{views} + std::uint64_t{lights} * channels));
}

std::uint64_t gm_formula_bits(const GmPayload& payload) {
  const GmMean& mean = payload.mean;
  return gm_mixture_bits(payload.mixture.shape, payload.mixture.precision) +
         gm_mean_bits(mean.form, mean.views, mean.lights, mean.pairs, mean.channels, mean.rank);
}

std::uint64_t gm_paper_bits(std::uint32_t components, std::uint32_t pairs, std::uint32_t channels,
                            bool mean_f32) {
  return std::uint64_t{32} * 2 * (kGmInputs + channels) * components +
         std::uint64_t{mean_f32 ? 32u : 8u} * pairs * channels;
}

std::uint64_t gm_paper_layout_bits(std::uint32_t components, std::uint32_t pairs, std::uint32_t channels,
                                   bool mean_f32) {
  return gm_paper_bits(components, pairs, channels, mean_f32) + std::uint64_t{32} * components;
}

GmMixture gm_ordered(const GmMixture& mixture, std::span<const double> energy) {
  std::vector<std::size_t> order(mixture.shape.components);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return energy[a] > energy[b]; });
  GmMixture out = gm_make_mixture(mixture.shape);
  for (std::uint32_t r = 0; r < mixture.shape.rows(); ++r) {
    for (std::size_t m = 0; m < order.size(); ++m) out.row(r)[m] = mixture.row(r)[order[m]];
  }
  return out;
}

}  // namespace btfc
