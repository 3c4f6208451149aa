// The mean BRDF as codes: whole values, or factors of low rank.
#include <algorithm>
#include <cmath>

#include "encoder/models/gm_samples.h"

namespace btfc {
namespace {

constexpr int kPowerSteps = 30;  // of the power iteration for a factor
constexpr int kRefitSteps = 4;   // of alternating rounding and least squares
constexpr double kMostCode = 127;

// One factor of the rest: view[v] * light[l * channels + c], by alternating least squares over the pairs
// that there are, by their weights.
struct Factor {
  std::vector<double> view, light;
};

struct Table {
  const std::vector<DirectionPair>& pairs;
  const std::vector<float>& weights;
  std::size_t views, lights, channels;
  std::vector<double> rest;
};

void fit_light(const Table& t, Factor& f) {
  std::vector<double> over(t.lights * t.channels), under(t.lights);
  for (std::size_t p = 0; p < t.pairs.size(); ++p) {
    const double v = f.view[t.pairs[p].view];
    const double weighted = double{t.weights[p]} * v;
    under[t.pairs[p].light] += weighted * v;
    for (std::size_t c = 0; c < t.channels; ++c) {
      over[t.pairs[p].light * t.channels + c] += weighted * t.rest[p * t.channels + c];
    }
  }
  for (std::size_t i = 0; i < over.size(); ++i) {
    f.light[i] = under[i / t.channels] > 0 ? over[i] / under[i / t.channels] : 0;
  }
}

void fit_view(const Table& t, Factor& f) {
  std::vector<double> over(t.views), under(t.views);
  for (std::size_t p = 0; p < t.pairs.size(); ++p) {
    for (std::size_t c = 0; c < t.channels; ++c) {
      const double l = f.light[t.pairs[p].light * t.channels + c], weighted = double{t.weights[p]} * l;
      over[t.pairs[p].view] += weighted * t.rest[p * t.channels + c];
      under[t.pairs[p].view] += weighted * l;
    }
  }
  for (std::size_t i = 0; i < over.size(); ++i) f.view[i] = under[i] > 0 ? over[i] / under[i] : 0;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::fabs(v));
  return most;
}

// Rounds to whole steps of the largest value / 127; returns the step.
double to_codes(std::vector<double>& values) {
  const double step = largest(values) / kMostCode;
  for (double& v : values) v = step > 0 ? std::nearbyint(v / step) * step : 0;
  return step;
}

std::int8_t code_of(double value, double step) {
  return static_cast<std::int8_t>(step > 0 ? std::lround(value / step) : 0);
}

GmMean factors(const GmSamples& samples, const std::vector<float>& table, std::uint32_t rank, GmMean mean) {
  Table t{samples.dataset->info().pairs, samples.weights, mean.views, mean.lights, mean.channels, {}};
  t.rest.assign(table.begin(), table.end());
  for (std::uint32_t k = 0; k < rank; ++k) {
    Factor f{std::vector<double>(t.views), std::vector<double>(t.lights * t.channels)};
    // A begin that is orthogonal to no factor in practice: a view's worth of uneven numbers.
    for (std::size_t v = 0; v < t.views; ++v) f.view[v] = 1 + 0.5 * std::sin(1.7 * double(v) * (k + 1));
    for (int step = 0; step < kPowerSteps; ++step) {
      fit_light(t, f);
      fit_view(t, f);
      const double scale = largest(f.view);
      if (scale > 0) {
        for (double& v : f.view) v /= scale;
      }
    }
    double view_step = 0, light_step = 0;
    for (int step = 0; step < kRefitSteps; ++step) {
      view_step = to_codes(f.view);
      fit_light(t, f);
      light_step = to_codes(f.light);
      if (step + 1 < kRefitSteps) fit_view(t, f);
    }
    const auto both = static_cast<float>(view_step * light_step);
    mean.steps.push_back(both);
    for (const double v : f.view) mean.view_codes.push_back(code_of(v, view_step));
    for (const double l : f.light) mean.light_codes.push_back(code_of(l, light_step));
    const std::size_t first_view = mean.view_codes.size() - t.views,
                      first_light = mean.light_codes.size() - f.light.size();
    for (std::size_t p = 0; p < t.pairs.size(); ++p) {
      for (std::size_t c = 0; c < t.channels; ++c) {
        t.rest[p * t.channels + c] -= double(both) * mean.view_codes[first_view + t.pairs[p].view] *
                                      mean.light_codes[first_light + t.pairs[p].light * t.channels + c];
      }
    }
  }
  return mean;
}

}  // namespace

GmMean gm_code_mean(const GmSamples& samples, const std::vector<float>& table, GmMeanForm form,
                    std::uint32_t rank) {
  const DatasetInfo& info = samples.dataset->info();
  GmMean mean;
  mean.form = form;
  mean.views = static_cast<std::uint32_t>(info.views.size());
  mean.lights = static_cast<std::uint32_t>(info.lights.size());
  mean.pairs = static_cast<std::uint32_t>(info.pairs.size());
  mean.channels = samples.channels;
  if (form == GmMeanForm::coded) {
    mean.rank = rank;
    return factors(samples, table, rank, std::move(mean));
  }
  mean.table = table;
  if (form == GmMeanForm::u8) {
    for (float& v : mean.table) v = std::nearbyint(std::clamp(v, 0.0f, 1.0f) * 255.0f) / 255.0f;
  }
  return mean;
}

std::vector<float> gm_decoded_mean(const GmSamples& samples, const GmMean& mean) {
  const std::vector<DirectionPair>& pairs = samples.dataset->info().pairs;
  std::vector<float> table(pairs.size() * mean.channels);
  for (std::uint32_t p = 0; p < pairs.size(); ++p) {
    for (std::uint32_t c = 0; c < mean.channels; ++c) {
      table[std::size_t{p} * mean.channels + c] = gm_mean_value(mean, p, pairs[p].view, pairs[p].light, c);
    }
  }
  return table;
}

}  // namespace btfc
