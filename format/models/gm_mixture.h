// Model gm: a Gaussian mixture over place and directions, its codes, the coded mean BRDF, and what they take.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/coded_rows.h"

namespace btfc {

inline constexpr std::uint32_t kGmMaxComponents = 65536;
inline constexpr std::uint32_t kGmMaxChannels = 4;
inline constexpr std::uint32_t kGmInputs = 6;  // x, y; view a, b; light a, b (shaders/models/gm.h)

// The angles of a direction: with_sign tells mirror directions apart, printed is the paper's own form.
enum class GmOnion : std::uint8_t { with_sign = 0, printed = 1 };

// How the mean BRDF is stored: a value a pair and channel, or factors of low rank.
enum class GmMeanForm : std::uint8_t { f32 = 0, u8 = 1, coded = 2 };

// Rows of a mixture: each has one number a component.
inline constexpr std::uint32_t kGmMeanRow = 0;     // 6: mu; texels, radians
inline constexpr std::uint32_t kGmSpreadRow = 6;   // 6: log2 sigma, so that steps are relative ones
inline constexpr std::uint32_t kGmHeightRow = 12;  // log2 of w_m / (sigma_1 … sigma_6): the gate's peak
inline constexpr std::uint32_t kGmOutputRow = 13;  // a row a channel: mu_7 …; then shear, if any: h_v, h_l

struct GmShape {
  std::uint32_t components = 0;  // M
  std::uint32_t channels = 3;
  bool shear = true;
  bool operator==(const GmShape&) const = default;
  std::uint32_t shear_row() const { return kGmOutputRow + channels; }
  std::uint32_t rows() const { return kGmOutputRow + channels + (shear ? 2 : 0); }
};

// What decoding uses of a mixture: values[row * components + m].
struct GmMixture {
  GmShape shape;
  std::vector<float> values;
  bool operator==(const GmMixture&) const = default;
  std::span<float> row(std::uint32_t r) {
    return {values.data() + std::size_t{r} * shape.components, shape.components};
  }
  std::span<const float> row(std::uint32_t r) const {
    return {values.data() + std::size_t{r} * shape.components, shape.components};
  }
};
GmMixture gm_make_mixture(const GmShape& shape);

// A mixture as it is stored: a row a row.
struct GmCodes {
  GmShape shape;
  CodedRows rows;
  bool operator==(const GmCodes&) const = default;
};
// scales: of u8, one a row; none: between the ends of each row.
GmCodes gm_quantise(const GmMixture& mixture, Precision precision, std::span<const RowScale> scales = {});
GmMixture gm_dequantise(const GmCodes& codes);

// The mean BRDF. f32, u8: table[pair * channels + channel]. coded: of the view v, light l and channel c
// sum over k of steps[k] * view_codes[k * views + v] * light_codes[(k * lights + l) * channels + c].
struct GmMean {
  GmMeanForm form = GmMeanForm::coded;
  std::uint32_t views = 0, lights = 0, pairs = 0, channels = 3, rank = 0;
  std::vector<float> table;
  std::vector<float> steps;
  std::vector<std::int8_t> view_codes, light_codes;
  bool operator==(const GmMean&) const = default;
};
// A table entry of the pair'th pair, which is of this view and light.
float gm_mean_value(const GmMean& mean, std::uint32_t pair, std::uint32_t view, std::uint32_t light,
                    std::uint32_t channel);

// Components before level `level` of `levels`: each level doubles them.
constexpr std::uint32_t gm_level_begin(std::uint32_t components, std::uint32_t levels, std::uint32_t level) {
  if (level == 0) return 0;
  const std::uint32_t shift = levels - level;
  return (components + (1u << shift) - 1) >> shift;
}

// Closed formulas, in bits; without head, parameters and directions.
std::uint64_t gm_mixture_bits(const GmShape& shape, Precision precision, std::uint32_t levels = 1);
std::uint64_t gm_mean_bits(GmMeanForm form, std::uint32_t views, std::uint32_t lights, std::uint32_t pairs,
                           std::uint32_t channels, std::uint32_t rank);
// The seed's own count: 9 means and 9 spreads of 32 bits a component, without the weights, and the mean BRDF
// of 8 or 32 bits a value.
std::uint64_t gm_paper_bits(std::uint32_t components, std::uint32_t pairs, std::uint32_t channels,
                            bool mean_f32);
// Components by falling energy, so that a prefix is a coarse mixture: the share that a component's gate holds
// of its neighbourhood is not known without data, so that energy[m] is given.
GmMixture gm_ordered(const GmMixture& mixture, std::span<const double> energy);

}  // namespace btfc
