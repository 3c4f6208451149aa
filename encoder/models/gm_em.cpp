// Expectation maximisation: start, maximisation, iterations.
#include "encoder/models/gm_em.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "encoder/models/gm_state.h"
#include "encoder/split_mix.h"

namespace btfc {
namespace {

constexpr double kLeastSamples = 5;  // fewer make a component dead
constexpr double kStartSpread = 0.5;

// Of shares that differ each iteration (Cappé, Moulines 2009): how much the new one counts. Steps that fall
// from one iteration to the next would calm the noise of small shares, but cost far more iterations.
constexpr double kNewShare = 0.8;
constexpr std::uint64_t kPhaseStep = 0x9e3779b1;  // odd and far from small fractions

// Moments about the means become those about the origin, or back.
void move_moments(const GmEmMixture& mixture, double way, GmEmSums& sums) {
  const std::size_t count = mixture.components;
  for (std::size_t i = 0; i < sums.first.size(); ++i) {
    const double shift = way * mixture.mean[i], sum = sums.sum[i % count];
    sums.second[i] += 2 * shift * sums.first[i] + shift * shift * sum;
    sums.first[i] += shift * sum;
  }
}

// kept = (1 - share) kept + share sums; sums = kept.
void blend(const GmEmMixture& mixture, GmEmSums& sums, double share, GmEmSums& kept) {
  move_moments(mixture, 1, sums);
  if (!kept.sum.empty()) {
    const auto mix = [&](std::vector<double>& to, const std::vector<double>& from) {
      for (std::size_t i = 0; i < to.size(); ++i) to[i] = share * to[i] + (1 - share) * from[i];
    };
    mix(sums.sum, kept.sum);
    mix(sums.first, kept.first);
    mix(sums.second, kept.second);
  }
  kept = sums;
  move_moments(mixture, -1, sums);
}

// Least spreads of all dimensions: a code of 8 bits in the channels.
std::array<double, kGmMostDims> floors_of(const GmSamples& samples) {
  std::array<double, kGmMostDims> floors{};
  floors.fill(1.0 / 255);
  const auto inputs = gm_spread_floors(samples);
  std::copy(inputs.begin(), inputs.end(), floors.begin());
  return floors;
}

}  // namespace

GmMixture gm_em_decoded(const GmEmMixture& mixture) {
  GmMixture out = gm_make_mixture({mixture.components, mixture.channels, false});
  const std::size_t count = mixture.components;
  for (std::size_t m = 0; m < count; ++m) {
    double height = std::log2(std::max(mixture.weight[m], 1e-300));
    for (std::uint32_t n = 0; n < kGmInputs; ++n) {
      const double log_spread = std::log2(mixture.spread[n * count + m]);
      out.row(kGmMeanRow + n)[m] = static_cast<float>(mixture.mean[n * count + m]);
      out.row(kGmSpreadRow + n)[m] = static_cast<float>(log_spread);
      height -= log_spread;
    }
    out.row(kGmHeightRow)[m] = static_cast<float>(height);
    for (std::uint32_t c = 0; c < mixture.channels; ++c) {
      out.row(kGmOutputRow + c)[m] = static_cast<float>(mixture.mean[(kGmInputs + c) * count + m]);
    }
  }
  return out;
}

void GmEmSums::clear(std::uint32_t components, std::uint32_t dimensions) {
  sum.assign(components, 0);
  first.assign(std::size_t{components} * dimensions, 0);
  second = first;
  log_likelihood = weight = 0;
  samples = listed = 0;
}

void GmEmSums::add(const GmEmSums& other) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other.sum[i];
  for (std::size_t i = 0; i < first.size(); ++i) first[i] += other.first[i];
  for (std::size_t i = 0; i < second.size(); ++i) second[i] += other.second[i];
  log_likelihood += other.log_likelihood;
  weight += other.weight;
  samples += other.samples;
  listed += other.listed;
}

GmEmMixture gm_em_maximise(const GmEmMixture& mixture, const GmEmSums& sums,
                           const std::array<double, kGmMostDims>& floors) {
  GmEmMixture out = mixture;
  const std::size_t count = mixture.components;
  const double all = std::accumulate(sums.sum.begin(), sums.sum.end(), 0.0);
  for (std::size_t m = 0; m < count; ++m) {
    out.weight[m] = sums.sum[m] / all;
    if (!(sums.sum[m] > 0)) continue;  // nothing moves it
    for (std::uint32_t n = 0; n < mixture.dimensions(); ++n) {
      const std::size_t at = n * count + m;
      const double shift = sums.first[at] / sums.sum[m];
      out.mean[at] = mixture.mean[at] + shift;
      const double variance = sums.second[at] / sums.sum[m] - shift * shift;
      out.spread[at] = std::max(floors[n], std::sqrt(std::max(variance, 0.0)));
    }
  }
  return out;
}

std::uint32_t gm_em_reseed(GmEmMixture& mixture, const GmEmSums& sums, double least) {
  const std::size_t count = mixture.components;
  std::vector<std::uint32_t> heaviest(count);
  std::iota(heaviest.begin(), heaviest.end(), 0u);
  std::stable_sort(heaviest.begin(), heaviest.end(),
                   [&](auto a, auto b) { return sums.sum[a] > sums.sum[b]; });
  std::uint32_t done = 0;
  for (std::size_t m = 0; m < count && done < count / 2; ++m) {
    const std::uint32_t parent = heaviest[done];
    if (sums.sum[m] >= least || sums.sum[parent] < 2 * least) continue;
    for (std::uint32_t n = 0; n < mixture.dimensions(); ++n) {
      mixture.mean[n * count + m] = mixture.mean[n * count + parent];
      mixture.spread[n * count + m] = mixture.spread[n * count + parent];
    }
    // The dimension that is widest beside its domain.
    const double domain[kGmInputs] = {1, 1, 0.05, 0.05, 0.05, 0.05};
    std::uint32_t widest = 0;
    for (std::uint32_t n = 1; n < kGmInputs; ++n) {
      if (mixture.spread[n * count + m] / domain[n] > mixture.spread[widest * count + m] / domain[widest]) {
        widest = n;
      }
    }
    const double aside = 0.25 * mixture.spread[widest * count + m];
    mixture.mean[widest * count + m] += aside;
    mixture.mean[widest * count + parent] -= aside;
    mixture.weight[m] = mixture.weight[parent] *= 0.5;
    ++done;
  }
  if (done > 0) {
    const double all = std::accumulate(mixture.weight.begin(), mixture.weight.end(), 0.0);
    for (double& w : mixture.weight) w /= all;
  }
  return done;
}

GmEmMixture gm_em_random(const GmSamples& samples, std::uint32_t components, std::uint64_t seed) {
  SplitMix64 random(seed);
  GmEmMixture out;
  out.components = components;
  out.channels = samples.channels;
  out.weight.assign(components, 1.0 / components);
  out.mean.resize(std::size_t{components} * out.dimensions());
  out.spread = out.mean;
  const auto draw = [&](double* s) {
    const std::uint32_t x = random.below(samples.width), y = random.below(samples.height),
                        p = samples.draw_pair(random);
    s[0] = x + 0.5;
    s[1] = y + 0.5;
    for (std::uint32_t n = 0; n < 4; ++n) s[2 + n] = double{samples.pairs[p].angle[n]};
    for (std::uint32_t c = 0; c < samples.channels; ++c) {
      s[kGmInputs + c] =
          double{samples.value(p, x, y, c)} - double{samples.mean[std::size_t{p} * samples.channels + c]};
    }
  };
  // Deviations of the data, from a few thousand samples.
  constexpr std::size_t kProbe = 4096;
  std::array<double, kGmMostDims> sum{}, square{}, s{};
  for (std::size_t i = 0; i < kProbe; ++i) {
    draw(s.data());
    for (std::uint32_t n = 0; n < out.dimensions(); ++n) {
      sum[n] += s[n];
      square[n] += s[n] * s[n];
    }
  }
  const auto floors = floors_of(samples);
  for (std::uint32_t m = 0; m < components; ++m) {
    draw(s.data());
    for (std::uint32_t n = 0; n < out.dimensions(); ++n) {
      const double middle = sum[n] / kProbe;
      const double deviation = std::sqrt(std::max(0.0, square[n] / kProbe - middle * middle));
      out.mean[std::size_t{n} * components + m] = s[n];
      out.spread[std::size_t{n} * components + m] = std::max(floors[n], kStartSpread * deviation);
    }
  }
  return out;
}

Bytes gm_em_state(const GmEmFit& fit) {
  StateWriter w;
  w.put(fit.mixture.components, fit.mixture.channels, fit.iterations, fit.reseeded);
  for (const auto* v : {&fit.mixture.weight, &fit.mixture.mean, &fit.mixture.spread, &fit.log_likelihood,
                        &fit.kept.sum, &fit.kept.first, &fit.kept.second})
    w.put_all(*v);
  return w.bytes();
}

std::optional<GmEmFit> gm_em_fit_of(ByteView state) {
  StateReader r(state);
  GmEmFit fit;
  GmEmMixture& m = fit.mixture;
  r.get(m.components, m.channels, fit.iterations, fit.reseeded);
  for (auto* v :
       {&m.weight, &m.mean, &m.spread, &fit.log_likelihood, &fit.kept.sum, &fit.kept.first, &fit.kept.second})
    r.get_all(*v);
  const std::size_t numbers = std::size_t{m.components} * m.dimensions();
  if (!r.complete() || m.weight.size() != m.components || m.mean.size() != numbers ||
      m.spread.size() != numbers)
    return std::nullopt;
  return fit;
}

GmEmFit gm_fit_em(const GmSamples& samples, const GmEmMixture& start, const GmEmOptions& options) {
  GmEmFit fit;
  fit.mixture = start;
  return gm_continue_em(samples, std::move(fit), options);
}

GmEmFit gm_continue_em(const GmSamples& samples, GmEmFit fit, const GmEmOptions& options,
                       const std::function<void(const GmEmFit&)>& step) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  const auto floors = floors_of(samples);
  GmEmPass pass;
  pass.reach = options.reach;
  pass.every = options.every;
  const auto settled = [&] {
    const std::vector<double>& l = fit.log_likelihood;
    return options.epsilon > 0 && l.size() > 1 && l.back() - l[l.size() - 2] < options.epsilon;
  };
  while (fit.iterations < options.iterations && !settled()) {
    // Shares far apart follow each other: neighbouring ones see nearly the same pairs.
    pass.phase = static_cast<std::uint32_t>(std::uint64_t{fit.iterations} * kPhaseStep % options.every);
    GmEmSums sums = gm_em_pass(samples, fit.mixture, pass);
    const double mean = sums.log_likelihood / sums.weight;
    fit.log_likelihood.push_back(mean);
    if (options.every > 1) blend(fit.mixture, sums, kNewShare, fit.kept);
    fit.mixture = gm_em_maximise(fit.mixture, sums, floors);
    fit.reseeded += gm_em_reseed(fit.mixture, sums, kLeastSamples);
    ++fit.iterations;
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    if (options.progress) options.progress(fit.iterations, mean, seconds);
    if (step) step(fit);
    if (options.seconds > 0 && seconds >= options.seconds) break;
  }
  return fit;
}

}  // namespace btfc
