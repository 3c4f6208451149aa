// Mean colours by distance of directions.
#include "encoder/segment/missing_pairs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace btfc {
namespace {

using Mean = std::array<double, 4>;

// Of at most four channels; one texel in so many each way is enough.
Mean mean_colour(const Dataset& dataset, std::size_t pair) {
  const Image image = dataset.image(pair);
  const std::uint32_t step = std::max(1u, std::min(image.width, image.height) / 32);
  Mean mean{};
  double count = 0;
  for (std::uint32_t y = 0; y < image.height; y += step) {
    for (std::uint32_t x = 0; x < image.width; x += step, ++count) {
      for (std::uint32_t c = 0; c < std::min(image.channels, 4u); ++c)
        mean[c] += double{code_value(image.type, image.at(x, y, c))};
    }
  }
  for (double& m : mean) m /= count;
  return mean;
}

// A pair without its turn about the normal, and the turn.
struct Place {
  double view_theta, light_theta, between;  // azimuth of the light from that of the view
  double turn;                              // of the view
};

Place place_of(const Direction& view, const Direction& light) {
  return {view.theta, light.theta, light.phi - view.phi, view.phi};
}

double square(double v) { return v * v; }

// Squared distance of (theta_a, 0) and (theta_b, phi) as unit vectors.
double chord(double theta_a, double theta_b, double phi) {
  return 2 -
         2 * (std::sin(theta_a) * std::sin(theta_b) * std::cos(phi) + std::cos(theta_a) * std::cos(theta_b));
}

constexpr double kTurn = 0.7, kExchange = 0.5;

double distance(const Place& a, const Place& b) {
  // Views alike but for their height, lights with their azimuths from the views; then the turn of the whole.
  const double slant = std::max(std::sin(a.view_theta), std::sin(a.light_theta));
  const double turned = square(2 * std::sin(0.5 * (a.turn - b.turn)) * slant * kTurn);
  return chord(a.view_theta, b.view_theta, 0) + chord(a.light_theta, b.light_theta, a.between - b.between) +
         turned;
}

}  // namespace

std::vector<std::uint16_t> complete_index(const Dataset& dataset, const std::vector<std::uint16_t>& of_pair,
                                          const std::vector<std::size_t>& medoids) {
  const DatasetInfo& info = dataset.info();
  const std::size_t lights = info.lights.size(), all = info.views.size() * lights;
  std::vector<Mean> means(info.pairs.size());
  std::vector<Place> places(means.size()), exchanged(means.size());
  tbb::parallel_for(std::size_t{0}, means.size(), [&](std::size_t p) {
    means[p] = mean_colour(dataset, p);
    const Direction &v = info.views[info.pairs[p].view], &l = info.lights[info.pairs[p].light];
    places[p] = place_of(v, l);
    exchanged[p] = place_of(l, v);
  });
  std::vector<std::uint16_t> out(all);
  std::vector<bool> measured(all);
  for (std::size_t p = 0; p < means.size(); ++p) {
    const std::size_t cell = info.pairs[p].view * lights + info.pairs[p].light;
    out[cell] = of_pair[p];
    measured[cell] = true;
  }
  tbb::parallel_for(std::size_t{0}, all, [&](std::size_t cell) {
    if (measured[cell]) return;
    const Place wanted = place_of(info.views[cell / lights], info.lights[cell % lights]);
    Mean sum{};
    double total = 0;
    for (std::size_t p = 0; p < means.size(); ++p) {
      const double d = std::min(distance(wanted, places[p]), kExchange + distance(wanted, exchanged[p]));
      const double w = std::pow(d + 1e-4, -4.0);
      total += w;
      for (std::size_t c = 0; c < 4; ++c) sum[c] += w * means[p][c];
    }
    std::size_t best = 0;
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < medoids.size(); ++k) {
      double off = 0;
      for (std::size_t c = 0; c < 4; ++c) off += square(sum[c] / total - means[medoids[k]][c]);
      if (off < least) {
        least = off;
        best = k;
      }
    }
    out[cell] = static_cast<std::uint16_t>(best);
  });
  return out;
}

}  // namespace btfc
