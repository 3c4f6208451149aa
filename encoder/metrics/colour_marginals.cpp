// Covariance, its eigenvectors by Jacobi's rotations, and sorted projections.
#include "encoder/metrics/colour_marginals.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "encoder/metrics/display_values.h"

namespace btfc {
namespace {

using Square = std::vector<std::vector<double>>;

// Jacobi 1846: turns planes until nothing is left off the diagonal. Columns of the result are eigenvectors.
Square diagonalise(Square& m) {
  const std::size_t n = m.size();
  Square vectors(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i) vectors[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {
    for (std::size_t p = 0; p < n; ++p) {
      for (std::size_t q = p + 1; q < n; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::hypot(theta, 1));
        const double c = 1 / std::hypot(t, 1), s = t * c;
        for (std::size_t k = 0; k < n; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double a = m[p][k], b = m[q][k], v = vectors[k][p], w = vectors[k][q];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
          vectors[k][p] = c * v - s * w;
          vectors[k][q] = s * v + c * w;
        }
      }
    }
  }
  return vectors;
}

}  // namespace

ColourAxes colour_axes(std::span<const Image> images) {
  const std::size_t n = images.front().channels;
  std::vector<double> mean(n);
  Square covariance(n, std::vector<double>(n));
  double texels = 0;
  for (const int pass : {0, 1}) {
    for (const Image& image : images) {
      const std::vector<float> display = display_table(image);
      for (std::size_t q = 0; q < image.codes.size(); q += n) {
        const auto value = [&](std::size_t c) { return static_cast<double>(display[image.codes[q + c]]); };
        for (std::size_t c = 0; c < n; ++c) {
          if (pass == 0) mean[c] += value(c);
          for (std::size_t d = 0; pass == 1 && d < n; ++d) {
            covariance[c][d] += (value(c) - mean[c]) * (value(d) - mean[d]) / texels;
          }
        }
      }
      if (pass == 0) texels += static_cast<double>(image.codes.size() / n);
    }
    for (std::size_t c = 0; pass == 0 && c < n; ++c) mean[c] /= texels;
  }
  const Square vectors = diagonalise(covariance);
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return covariance[i][i] > covariance[j][j]; });
  ColourAxes out;
  for (const std::size_t i : order) {
    std::vector<double> axis;
    for (std::size_t c = 0; c < n; ++c) axis.push_back(vectors[c][i]);
    out.axes.push_back(axis);
    out.deviations.push_back(std::fmax(std::sqrt(std::fmax(0, covariance[i][i])), 1 / 255.0));
  }
  return out;
}

ColourMarginals colour_marginals(const ColourAxes& axes, const Image& image) {
  const std::vector<float> display = display_table(image);
  ColourMarginals out;
  for (std::size_t i = 0; i < axes.axes.size(); ++i) {
    const std::vector<double>& axis = axes.axes[i];
    std::vector<double> places;
    places.reserve(image.codes.size() / image.channels);
    for (std::size_t q = 0; q < image.codes.size(); q += image.channels) {
      double sum = 0;
      for (std::size_t c = 0; c < axis.size(); ++c)
        sum += axis[c] * static_cast<double>(display[image.codes[q + c]]);
      places.push_back(sum / axes.deviations[i]);
    }
    std::sort(places.begin(), places.end());
    out.push_back(std::move(places));
  }
  return out;
}

std::vector<double> marginal_distances(const ColourMarginals& a, const ColourMarginals& b) {
  std::vector<double> out;
  for (std::size_t i = 0; i < a.size(); ++i) {
    double sum = 0;
    for (std::size_t q = 0; q < a[i].size(); ++q) sum += std::fabs(a[i][q] - b[i][q]);
    out.push_back(sum / static_cast<double>(a[i].size()));
  }
  return out;
}

}  // namespace btfc
