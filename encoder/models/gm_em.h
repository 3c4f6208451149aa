// The paper's fit of model gm: expectation maximisation of a product mixture over texel, directions and
// colour (eqs 1-7), over all samples or a fixed stratified share of them.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "encoder/models/gm_samples.h"
#include "format/models/gm_mixture.h"

namespace btfc {

inline constexpr std::uint32_t kGmMostDims = kGmInputs + kGmMaxChannels;

// The whole mixture of eq. 1: number[dimension * components + m]. Dimensions 0 … 5 are the inputs, then the
// channels with the mean BRDF taken off.
struct GmEmMixture {
  std::uint32_t components = 0, channels = 0;
  std::vector<double> weight;        // w_m, adds up to 1
  std::vector<double> mean, spread;  // mu, sigma
  std::uint32_t dimensions() const { return kGmInputs + channels; }
  bool operator==(const GmEmMixture&) const = default;
};

// What decoding uses of it (eqs 8-11): spreads of the colours are left out.
GmMixture gm_em_decoded(const GmEmMixture& mixture);

// Sums of one pass over samples by their weights, with the moments about the present means (eqs 5-7): sum[m],
// first[dimension * components + m], second likewise.
struct GmEmSums {
  std::vector<double> sum, first, second;
  double log_likelihood = 0;  // natural, over samples (eq. 3 times |S|)
  double weight = 0;          // of the samples, each its pair's
  std::uint64_t samples = 0;
  std::uint64_t listed = 0;  // components looked at, over samples
  void clear(std::uint32_t components, std::uint32_t dimensions);
  void add(const GmEmSums& other);
};

struct GmEmPass {
  // Culling over a rectangle, powers of two: a component whose share of every sample's density there is
  // certainly below 2^-reach is left out. 0: none is.
  float reach = 24;
  std::uint32_t every = 1;  // of the pairs each rectangle is seen under: 1: all; others a fixed share
  std::uint32_t phase = 0;  // which of them: 0 … every-1
};

// A pass over all rectangles of the tile; threads do not change a bit.
GmEmSums gm_em_pass(const GmSamples& samples, const GmEmMixture& mixture, const GmEmPass& pass);
// The same as a plain double loop over samples and components, with no table, list or vector: the reference.
// first_pair, pair_count: which pairs.
GmEmSums gm_em_pass_plain(const GmSamples& samples, const GmEmMixture& mixture, std::uint32_t first_pair,
                          std::uint32_t pair_count);

// Eqs 5-7, spreads at least at their floors, which is where the likelihood is highest then.
GmEmMixture gm_em_maximise(const GmEmMixture& mixture, const GmEmSums& sums,
                           const std::array<double, kGmMostDims>& floors);
// Components with fewer than `least` samples become one half each of the heaviest ones, a quarter of a spread
// aside along the widest dimension; returns how many.
std::uint32_t gm_em_reseed(GmEmMixture& mixture, const GmEmSums& sums, double least);

struct GmEmOptions {
  std::uint32_t components = 600;
  std::uint32_t iterations = 40;
  double epsilon = 0;  // ends where the mean log-likelihood grows by less; 0: never
  double seconds = 0;  // ends at an iteration's end once so much time is spent; 0: never
  std::uint64_t seed = 1;
  std::uint32_t every = 1;  // share of the pairs, GmEmPass
  float reach = 24;
  std::function<void(std::uint32_t iteration, double log_likelihood, double seconds)> progress;
};

// A fit, done or under way.
struct GmEmFit {
  GmEmMixture mixture;
  std::vector<double> log_likelihood;  // of eq. 3, before each iteration
  std::uint32_t iterations = 0, reseeded = 0;
  GmEmSums kept;  // running means of the shares, in absolute moments
};
// As bytes, and back; none where they are no such state.
Bytes gm_em_state(const GmEmFit& fit);
std::optional<GmEmFit> gm_em_fit_of(ByteView state);

// Means at random samples, spreads half those of the data, equal weights.
GmEmMixture gm_em_random(const GmSamples& samples, std::uint32_t components, std::uint64_t seed);
// From a given mixture, as of gm_em_random.
GmEmFit gm_fit_em(const GmSamples& samples, const GmEmMixture& start, const GmEmOptions& options);
// Goes on with a fit up to options.iterations in all; `step` hears of it after each.
GmEmFit gm_continue_em(const GmSamples& samples, GmEmFit fit, const GmEmOptions& options,
                       const std::function<void(const GmEmFit&)>& step = {});

}  // namespace btfc
