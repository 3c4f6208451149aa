// Moments under a Gaussian window: along each row as it comes, then down the last eleven rows.
#include "encoder/metrics/ssim.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "encoder/metrics/row_filter.h"

namespace btfc {
namespace {

constexpr std::size_t kWindow = 11;
constexpr double kSigma = 1.5;
constexpr float kC1 = 0.01f * 0.01f, kC2 = 0.03f * 0.03f;
// Taken off the values: variances do not change, and lose fewer digits to cancellation.
constexpr float kCentre = 0.5f;

std::array<float, kWindow> gaussian() {
  std::array<double, kWindow> g{};
  double sum = 0;
  for (std::size_t i = 0; i < kWindow; ++i) {
    const double d = static_cast<double>(i) - (kWindow - 1) / 2.0;
    sum += g[i] = std::exp(-d * d / (2 * kSigma * kSigma));
  }
  std::array<float, kWindow> taps{};
  for (std::size_t i = 0; i < kWindow; ++i) taps[i] = static_cast<float>(g[i] / sum);
  return taps;
}

}  // namespace

double ssim_by_rows(const CodeView& a, const CodeView& b) {
  if (a.width < kWindow || a.height < kWindow) return std::numeric_limits<double>::quiet_NaN();
  const auto taps = gaussian();
  const std::size_t width = a.width, out_width = width - kWindow + 1;
  constexpr std::size_t kMoments = 4;  // a, b, a^2 + b^2, ab
  std::vector<float> moments(kMoments * width), means(kMoments * out_width);
  const auto moment = [&](std::size_t m) { return std::span(moments).subspan(m * width, width); };
  const auto mean = [&](std::size_t m) { return std::span(means).subspan(m * out_width, out_width); };
  std::vector<RowRing> rings(kMoments, RowRing(kWindow, out_width));
  double sum = 0;
  for (std::uint32_t y = 0; y < a.height; ++y) {
    a.grey_row(y, moment(0));
    b.grey_row(y, moment(1));
    float* const v = moments.data();
    for (std::size_t x = 0; x < width; ++x) {
      const float va = v[x] - kCentre, vb = v[width + x] - kCentre;
      v[x] = va;
      v[width + x] = vb;
      v[2 * width + x] = va * va + vb * vb;
      v[3 * width + x] = va * vb;
    }
    for (std::size_t m = 0; m < kMoments; ++m) filter_along(taps, moment(m).data(), rings[m].row(y));
    if (y + 1 < kWindow) continue;
    for (std::size_t m = 0; m < kMoments; ++m) {
      std::array<const float*, kWindow> rows{};
      for (std::size_t t = 0; t < kWindow; ++t) rows[t] = rings[m].row(y + 1 - kWindow + t).data();
      weigh_rows(taps, rows, mean(m));
    }
    float* const e = means.data();
    for (std::size_t x = 0; x < out_width; ++x) {
      const float ma = e[x], mb = e[out_width + x];
      const float variances = e[2 * out_width + x] - ma * ma - mb * mb;
      const float covariance = e[3 * out_width + x] - ma * mb;
      const float ua = ma + kCentre, ub = mb + kCentre;
      e[x] = (2 * ua * ub + kC1) * (2 * covariance + kC2) / ((ua * ua + ub * ub + kC1) * (variances + kC2));
    }
    for (std::size_t x = 0; x < out_width; ++x) sum += static_cast<double>(e[x]);
  }
  return sum / (static_cast<double>(out_width) * static_cast<double>(a.height - kWindow + 1));
}

}  // namespace btfc
