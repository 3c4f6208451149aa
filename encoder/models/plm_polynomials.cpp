// Image by image: values of the lobes, measured values, and the curve between them.
#include "encoder/models/plm_polynomials.h"

#include <algorithm>
#include <array>
#include <span>

#include "encoder/dataset/view_pairs.h"
#include "encoder/for_each_index.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/linear/matrix.h"
#include "encoder/models/plm_lobes.h"
#include "format/models/plm_payload.h"
#include "shaders/models/plm.h"

namespace btfc {
namespace {

using Terms = std::array<float, kPlmTerms>;
constexpr Terms kIdentity = {1, 0, 0, 0, 0};
// Towards the identity, per texel, values counted in units of the largest: the first that gives a tame curve.
constexpr double kDraws[] = {1e-5, 1e-4, 1e-3, 1e-2, 1e-1};
constexpr double kReach = 1.02;  // coded directions may be a little longer than 1
constexpr double kMostTerms = 32, kMostValue = 2;

// Whether a curve stays near the values of its view, `scale` at most, up to the argument `reach`, and does
// not get there by terms that cancel.
bool tame(const Terms& b, double reach, double scale) {
  double terms = 0, power = reach;
  for (const float term : b) {
    terms += std::abs(term) * power;
    power *= reach;
  }
  if (!(terms <= kMostTerms * scale)) return false;
  for (int i = 1; i <= 32; ++i) {
    const double y = reach * i / 32;
    const double value = ((((b[4] * y + b[3]) * y + b[2]) * y + b[1]) * y + b[0]) * y;
    if (!(std::abs(value) <= kMostValue * scale)) return false;
  }
  return true;
}

// Least squares of target ~ sum_j b_j value^j. reach: the largest argument that may come under other lights.
Terms nearest_polynomial(std::span<const float> values, std::span<const float> targets, double reach) {
  const double unit = *std::max_element(values.begin(), values.end());
  if (!(unit > 1e-9)) return kIdentity;
  // Sums of y^0 … y^10 and of r y^0 … r y^5.
  std::array<double, 2 * kPlmTerms + 1> moment{};
  std::array<double, kPlmTerms + 1> cross{};
  for (std::size_t t = 0; t < values.size(); ++t) {
    const double y = values[t] / unit, r = targets[t] / unit;
    double power = 1;
    for (std::size_t j = 0; j <= kPlmTerms; ++j, power *= y) {
      moment[j] += power;
      cross[j] += r * power;
    }
    for (std::size_t j = kPlmTerms + 1; j <= 2 * kPlmTerms; ++j, power *= y) moment[j] += power;
  }
  Eigen::Matrix<double, kPlmTerms, kPlmTerms> product;
  Eigen::Matrix<double, kPlmTerms, 1> right;
  for (std::size_t j = 1; j <= kPlmTerms; ++j) {
    for (std::size_t k = 1; k <= kPlmTerms; ++k) product(as_index(j - 1), as_index(k - 1)) = moment[j + k];
    right(as_index(j - 1)) = cross[j];
  }
  const double scale = std::max<double>(reach, *std::max_element(targets.begin(), targets.end()));
  for (const double each : kDraws) {
    const double draw = each * static_cast<double>(values.size());
    Eigen::Matrix<double, kPlmTerms, kPlmTerms> drawn = product;
    drawn.diagonal().array() += draw;
    Eigen::Matrix<double, kPlmTerms, 1> target = right;
    target(0) += draw;
    const Eigen::Matrix<double, kPlmTerms, 1> solved = drawn.ldlt().solve(target);
    Terms terms{};
    double power = 1;
    for (std::size_t j = 0; j < kPlmTerms; ++j, power /= unit)
      terms[j] = static_cast<float>(solved(as_index(j)) * power);
    if (tame(terms, reach, scale)) return terms;
  }
  return kIdentity;
}

double squares_of(std::span<const float> values, std::span<const float> targets, const Terms& b) {
  double sum = 0;
  for (std::size_t t = 0; t < values.size(); ++t) {
    const float rest = targets[t] - btfc_lobe_polynomial(b[0], b[1], b[2], b[3], b[4], values[t]);
    sum += static_cast<double>(rest) * rest;
  }
  return sum;
}

// Of one channel of all texels towards a light.
void values_of_lobes(const LobePlanes& planes, std::size_t channel, std::size_t channels,
                     const Vector3& light, std::vector<float>& values) {
  std::array<const float*, kLobeParameters> parameters{};
  for (std::size_t m = 0; m < kLobeParameters; ++m)
    parameters[m] = &planes[(m * channels + channel) * values.size()];
  lobe_values(parameters, values.size(),
              {static_cast<float>(light[0]), static_cast<float>(light[1]), static_cast<float>(light[2])},
              values.data());
}

// One image's share of the result.
struct ImageFit {
  std::size_t kept = 0;
  double lobe_squares = 0, squares = 0;
};

}  // namespace

PlmPolynomials fit_polynomials(const Dataset& dataset, const Directions& directions,
                               const std::vector<LobePlanes>& views, PlmPolynomial kind,
                               const std::function<void(std::size_t, std::size_t)>& progress) {
  const DatasetInfo& info = dataset.info();
  const std::size_t channels = info.channels.size(), pairs = info.pairs.size();
  const std::size_t texels = std::size_t{info.width} * info.height;
  const std::vector<float> table = value_table(info.type);
  PlmPolynomials result;
  result.terms.resize(kPlmTerms * channels * pairs);
  std::vector<ImageFit> images(pairs);
  // The largest rho of a view and channel: |a| is 1, so no light gives more.
  std::vector<float> largest;
  for (const LobePlanes& planes : views) {
    for (std::size_t c = 0; c < channels; ++c) {
      const auto first = planes.begin() + static_cast<std::ptrdiff_t>(c * texels);
      largest.push_back(*std::max_element(first, first + static_cast<std::ptrdiff_t>(texels)));
    }
  }
  const auto fit_image = [&](std::size_t pair) {
    std::vector<std::uint16_t> codes(info.image_samples());
    dataset.read_image(pair, codes);
    const LobePlanes& planes = views[info.pairs[pair].view];
    const Vector3 light = unit_vector(directions.lights[info.pairs[pair].light]);
    std::vector<float> values(texels), targets(texels), sorted_values, sorted_targets;
    for (std::size_t c = 0; c < channels; ++c) {
      values_of_lobes(planes, c, channels, light, values);
      const double reach = kReach * largest[info.pairs[pair].view * channels + c];
      for (std::size_t t = 0; t < texels; ++t) targets[t] = table[codes[t * channels + c]];
      const double before = squares_of(values, targets, kIdentity);
      Terms terms = kIdentity;
      if (kind == PlmPolynomial::histogram) {
        sorted_values = values;
        sorted_targets = targets;
        std::sort(sorted_values.begin(), sorted_values.end());
        std::sort(sorted_targets.begin(), sorted_targets.end());
        terms = nearest_polynomial(sorted_values, sorted_targets, reach);
      } else if (kind == PlmPolynomial::least_squares) {
        terms = nearest_polynomial(values, targets, reach);
      }
      double after = terms == kIdentity ? before : squares_of(values, targets, terms);
      if (!(after < before)) {
        after = before;
        terms = kIdentity;
      }
      images[pair].kept += terms != kIdentity;
      images[pair].lobe_squares += before;
      images[pair].squares += after;
      for (std::size_t j = 0; j < kPlmTerms; ++j) result.terms[(j * channels + c) * pairs + pair] = terms[j];
    }
    return Result<Done>(Done{});
  };
  static_cast<void>(for_each_index(pairs, fit_image, progress));
  // A pair's polynomials are its own: its weight counts in the sums alone.
  for (std::size_t pair = 0; pair < pairs; ++pair) {
    result.kept += images[pair].kept;
    result.lobe_squares += info.weight(pair) * images[pair].lobe_squares;
    result.squares += info.weight(pair) * images[pair].squares;
  }
  return result;
}

}  // namespace btfc
