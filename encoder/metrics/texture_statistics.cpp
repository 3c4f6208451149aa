// Gradients, spectra and histograms, all sums in doubles and in a fixed order.
#include "encoder/metrics/texture_statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "encoder/metrics/display_values.h"
#include "format/fourier.h"

namespace btfc {
namespace {

constexpr std::uint32_t kMostBlock = 64, kMostBlocksASide = 32;
constexpr double kLeastGradient = 1e-6;
constexpr double kRounding = 1 / (12.0 * 255 * 255);

// Calls visit(q, bit, |difference|) for all neighbours.
template <class Visit>
void for_each_pair(const std::vector<double>& values, std::size_t width, std::size_t height,
                   const Visit& visit) {
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t q = y * width + x;
      if (x + 1 < width) visit(q, JoinMask::kRight, std::fabs(values[q + 1] - values[q]));
      if (y + 1 < height) visit(q, JoinMask::kBelow, std::fabs(values[q + width] - values[q]));
    }
  }
}

double mean(double sum, std::uint64_t count) { return count == 0 ? 0 : sum / static_cast<double>(count); }

// Where blocks begin along a side: evenly from 0 to side - block.
std::vector<std::uint32_t> block_begins(std::uint32_t side, std::uint32_t block) {
  const std::uint32_t last = side - block, half = std::max(1u, block / 2);
  const std::uint32_t count = std::min(kMostBlocksASide, (last + half - 1) / half + 1);
  std::vector<std::uint32_t> begins(count);
  for (std::uint32_t i = 1; i < count; ++i) {
    begins[i] = static_cast<std::uint32_t>(std::uint64_t{last} * i / (count - 1));
  }
  return begins;
}

Spectrum spectrum_of(const std::vector<double>& values, std::uint32_t width, std::uint32_t height,
                     std::uint32_t block) {
  const std::size_t n = block;
  std::vector<double> window(n);  // sampled between texels, so that none weighs 0
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double s = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    window[i] = s * s;
    sum += window[i];
    squares += window[i] * window[i];
  }
  const Fourier fourier(n);
  Spectrum out{block, std::vector<double>(n * n)};
  std::vector<std::complex<double>> f(n * n);
  const auto columns = block_begins(width, block), rows = block_begins(height, block);
  for (const std::uint32_t top : rows) {
    for (const std::uint32_t left : columns) {
      const auto value = [&](std::size_t i, std::size_t j) {
        return values[(top + j) * std::size_t{width} + left + i];
      };
      double centre = 0;  // the mean under the window, so that frequency 0 leaks nowhere
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t i = 0; i < n; ++i) centre += window[i] * window[j] * value(i, j);
      }
      centre /= sum * sum;
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t i = 0; i < n; ++i) f[j * n + i] = window[i] * window[j] * (value(i, j) - centre);
      }
      fourier.transform_square(f);
      for (std::size_t k = 0; k < f.size(); ++k) out.power[k] += std::norm(f[k]);
    }
  }
  const double scale = squares * squares * static_cast<double>(rows.size() * columns.size());
  for (double& p : out.power) p /= scale;
  return out;
}

}  // namespace

std::uint32_t spectrum_block(std::uint32_t width, std::uint32_t height) {
  std::uint32_t block = kMostBlock;
  while (block > width || block > height) block /= 2;
  return std::max(1u, block);
}

TextureStatistics texture_statistics(const Image& image, std::uint32_t block) {
  const std::vector<float> display = display_table(image);
  const std::vector<double> values = luma(image, display);
  TextureStatistics out;
  double sum = 0;
  std::uint64_t pairs = 0;
  for_each_pair(values, image.width, image.height, [&](std::size_t, std::uint8_t, double d) {
    sum += d;
    ++pairs;
  });
  out.gradient = mean(sum, pairs);
  out.spectrum = spectrum_of(values, image.width, image.height, block);

  const double texels = static_cast<double>(values.size());
  for (std::uint32_t c = 0; c < image.channels; ++c) {
    std::array<double, 256> histogram{};
    double first = 0, second = 0;
    for (std::size_t q = 0; q < values.size(); ++q) {
      const double v = static_cast<double>(display[image.codes[q * image.channels + c]]);
      histogram[static_cast<std::size_t>(std::lround(255 * v))] += 1 / texels;
      first += v / texels;
      second += v * v / texels;
    }
    out.histograms.push_back(histogram);
    out.deviations.push_back(std::sqrt(std::fmax(0, second - first * first)));
  }
  return out;
}

double gradient_ratio(double numerator, double denominator) {
  return (numerator + kLeastGradient) / (denominator + kLeastGradient);
}

double gradient_kept(const TextureStatistics& reference, const TextureStatistics& candidate) {
  return gradient_ratio(candidate.gradient, reference.gradient);
}

double spectrum_distance(const Spectrum& reference, const Spectrum& candidate) {
  const std::size_t n = reference.block;
  double sum = 0, weights = 0;
  for (std::size_t k = 1; k < n * n; ++k) {
    const std::size_t x = std::min(k % n, n - k % n), y = std::min(k / n, n - k / n);
    const double weight = 1 / std::sqrt(static_cast<double>(x * x + y * y));
    sum += weight * std::fabs(std::log((candidate.power[k] + kRounding) / (reference.power[k] + kRounding)));
    weights += weight;
  }
  return weights == 0 ? 0 : sum / weights;  // a block of one texel has no frequencies but 0
}

double colour_distance(const TextureStatistics& reference, const TextureStatistics& candidate) {
  double sum = 0;
  for (std::size_t c = 0; c < reference.histograms.size(); ++c) {
    double below = 0, area = 0;  // the area between the cumulative histograms
    for (std::size_t i = 0; i < 256; ++i) {
      below += candidate.histograms[c][i] - reference.histograms[c][i];
      area += std::fabs(below) / 255;
    }
    sum += area / std::fmax(reference.deviations[c], 1 / 255.0);
  }
  return sum / static_cast<double>(reference.histograms.size());
}

std::optional<double> JoinGradients::seam_ratio() const {
  if (join_pairs == 0 || interior_pairs == 0) return std::nullopt;
  return gradient_ratio(joins, interior);
}

JoinGradients join_gradients(const Image& image, const JoinMask& mask) {
  const std::vector<double> values = luma(image, display_table(image));
  JoinGradients out;
  for_each_pair(values, image.width, image.height, [&](std::size_t q, std::uint8_t bit, double d) {
    const bool join = (mask.bits[q] & bit) != 0;
    (join ? out.joins : out.interior) += d;
    ++(join ? out.join_pairs : out.interior_pairs);
  });
  out.joins = mean(out.joins, out.join_pairs);
  out.interior = mean(out.interior, out.interior_pairs);
  return out;
}

}  // namespace btfc
