// What the fits of model gm see of a data set: values with the mean BRDF taken off, on texels times pairs of
// directions, and the pairs in groups of like directions.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/split_mix.h"
#include "format/models/gm_field.h"
#include "format/models/gm_mixture.h"

namespace btfc {

// Pairs whose views lie close together, and whose lights do.
struct GmPairGroup {
  GmBox box;  // of the directions alone
  std::vector<std::uint32_t> pairs;
};

// Refers to the data set, which must outlive it.
struct GmSamples {
  const Dataset* dataset = nullptr;
  std::uint32_t width = 0, height = 0, channels = 0;
  bool wraps = false;
  std::vector<float> values;  // of a code, in the transform of the fit
  float low = 0, high = 1;    // where what is decoded is cut off: the ends of values
  std::vector<GmPairInputs> pairs;
  std::vector<GmPairGroup> groups;
  std::vector<float> weights;              // of the pairs, with mean 1: how much a squared error counts
  std::vector<double> cumulative_weights;  // up to each pair and with it; none: all alike
  std::vector<float> mean;                 // as a decoder sees it: [pair * channels + channel]; none at first
  // Codes of 8 bits by pair, row, texel, where they are few enough to be held; else the data set is asked.
  std::vector<std::uint8_t> near;

  // A pair at random, as often as it counts.
  std::uint32_t draw_pair(SplitMix64& random) const;
  std::uint64_t count() const { return std::uint64_t{width} * height * pairs.size(); }
  float value(std::size_t pair, std::uint32_t x, std::uint32_t y, std::uint32_t channel) const {
    return values[dataset->code(pair, x, y, channel)];
  }
  // Values less the mean of a rectangle of texels, rows from its top, channels interleaved.
  void rectangle(std::size_t pair, std::uint32_t x, std::uint32_t y, std::uint32_t columns,
                 std::uint32_t rows, float* out) const;
};

// channels of the data set: 1 … 4. transform: identity, or log for values without an upper end.
GmSamples gm_samples(const Dataset& dataset, ValueTransform transform = ValueTransform::identity,
                     GmOnion onion = GmOnion::with_sign);

// Least spreads of the inputs: a third of a texel and of the step between measured directions.
std::array<double, kGmInputs> gm_spread_floors(const GmSamples& samples);

// values[pair * channels + channel]: means over texels (eq. 11's mean BRDF), in doubles. On the threads of
// the calling oneTBB arena; the sums do not depend on them.
std::vector<float> gm_mean_table(const GmSamples& samples);

// The mean BRDF as stored. u8 keeps values in [0, 1]. coded: factors of the given rank, each the best one for
// what the ones before it leave, with codes refitted after rounding; pairs that are missing count for
// nothing, others by their weights.
GmMean gm_code_mean(const GmSamples& samples, const std::vector<float>& table, GmMeanForm form,
                    std::uint32_t rank);
// A decoder's table of it.
std::vector<float> gm_decoded_mean(const GmSamples& samples, const GmMean& mean);

}  // namespace btfc
