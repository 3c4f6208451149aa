// Rounding, codes, sizes, order.
#include "format/models/gm_mixture.h"

#include <algorithm>
#include <numeric>

namespace btfc {
GmMixture gm_make_mixture(const GmShape& shape) {
  return {shape, std::vector<float>(std::size_t{shape.rows()} * shape.components)};
}

GmCodes gm_quantise(const GmMixture& mixture, Precision precision, std::span<const RowScale> scales) {
  const GmShape& shape = mixture.shape;
  return {shape, code_rows(mixture.values, shape.rows(), shape.components, precision, scales)};
}

GmMixture gm_dequantise(const GmCodes& codes) {
  GmMixture mixture = gm_make_mixture(codes.shape);
  for (std::uint32_t r = 0; r < codes.shape.rows(); ++r) {
    for (std::uint32_t m = 0; m < codes.shape.components; ++m) mixture.row(r)[m] = codes.rows.value(r, m);
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

std::uint64_t gm_mixture_bits(const GmShape& shape, Precision precision, std::uint32_t levels) {
  std::uint64_t bytes = precision == Precision::u8 ? std::uint64_t{8} * shape.rows() : 0;
  for (std::uint32_t l = 0; l < levels; ++l) {
    const std::uint32_t count =
        gm_level_begin(shape.components, levels, l + 1) - gm_level_begin(shape.components, levels, l);
    bytes += 4 * element_words(std::uint64_t{shape.rows()} * count, precision);
  }
  return 8 * bytes;
}

std::uint64_t gm_mean_bits(GmMeanForm form, std::uint32_t views, std::uint32_t lights, std::uint32_t pairs,
                           std::uint32_t channels, std::uint32_t rank) {
  if (form == GmMeanForm::f32) return std::uint64_t{32} * pairs * channels;
  if (form == GmMeanForm::u8) return std::uint64_t{8} * pairs * channels;
  return rank * (32 + 8 * (std::uint64_t{views} + std::uint64_t{lights} * channels));
}

std::uint64_t gm_paper_bits(std::uint32_t components, std::uint32_t pairs, std::uint32_t channels,
                            bool mean_f32) {
  return std::uint64_t{32} * 2 * (kGmInputs + channels) * components +
         std::uint64_t{mean_f32 ? 32u : 8u} * pairs * channels;
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
