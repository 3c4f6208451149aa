// PSNR, RMSE, peak and SSIM, pooled over all texels and channels in doubles; colour measures by rows.
#include "encoder/metrics/image_metrics.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "encoder/metrics/display_values.h"
#include "encoder/metrics/flip.h"
#include "encoder/metrics/lab.h"

namespace btfc {
namespace {

constexpr int kWindow = 11;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::array<double, kWindow> gaussian() {  // sigma 1.5, sum 1
  std::array<double, kWindow> g{};
  double sum = 0;
  for (int i = 0; i < kWindow; ++i)
    sum += g[static_cast<std::size_t>(i)] = std::exp(-(i - 5) * (i - 5) / (2 * 1.5 * 1.5));
  for (double& v : g) v /= sum;
  return g;
}

// Separable 11x11 filter over the valid region.
std::vector<double> filtered(const std::vector<double>& in, std::size_t width, std::size_t height) {
  const auto g = gaussian();
  const std::size_t w = width - kWindow + 1, h = height - kWindow + 1;
  std::vector<double> rows(w * height), out(w * h);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < w; ++x) {
      double sum = 0;
      for (std::size_t t = 0; t < kWindow; ++t) sum += g[t] * in[y * width + x + t];
      rows[y * w + x] = sum;
    }
  }
  for (std::size_t y = 0; y < h; ++y) {
    for (std::size_t x = 0; x < w; ++x) {
      double sum = 0;
      for (std::size_t t = 0; t < kWindow; ++t) sum += g[t] * rows[(y + t) * w + x];
      out[y * w + x] = sum;
    }
  }
  return out;
}

std::vector<double> product(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
  return out;
}

// Wang, Bovik, Sheikh, Simoncelli 2004: K1 = 0.01, K2 = 0.03, L = 1.
double ssim(const std::vector<double>& a, const std::vector<double>& b, std::size_t width,
            std::size_t height) {
  if (width < kWindow || height < kWindow) return kNaN;
  const auto ma = filtered(a, width, height), mb = filtered(b, width, height);
  const auto aa = filtered(product(a, a), width, height), bb = filtered(product(b, b), width, height);
  const auto ab = filtered(product(a, b), width, height);
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  double sum = 0;
  for (std::size_t i = 0; i < ma.size(); ++i) {
    const double va = aa[i] - ma[i] * ma[i], vb = bb[i] - mb[i] * mb[i], cov = ab[i] - ma[i] * mb[i];
    sum +=
        (2 * ma[i] * mb[i] + c1) * (2 * cov + c2) / ((ma[i] * ma[i] + mb[i] * mb[i] + c1) * (va + vb + c2));
  }
  return sum / static_cast<double>(ma.size());
}

}  // namespace

Result<ImageMetrics> compare_images(const Image& a, const Image& b, const MetricOptions& options) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) {
    return bad_argument(fmt::format("the images differ in form: {}x{} with {} channels and {}x{} with {}",
                                    a.width, a.height, a.channels, b.width, b.height, b.channels));
  }
  const auto da = display_table(a), db = display_table(b);
  ImageMetrics m;
  m.samples = a.codes.size();
  double sum = 0, peak = 0;
  for (std::size_t i = 0; i < a.codes.size(); ++i) {
    const double d = static_cast<double>(da[a.codes[i]]) - static_cast<double>(db[b.codes[i]]);
    sum += d * d;
    peak = std::fmax(peak, std::fabs(d));
    if (a.type != b.type || a.codes[i] != b.codes[i]) ++m.differing_samples;
  }
  const double mse = sum / static_cast<double>(m.samples);
  m.psnr_db = mse == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(mse);
  m.rmse_8bit = 255 * std::sqrt(mse);
  m.peak_8bit = 255 * peak;
  m.ssim = options.ssim ? ssim(luma(a, da), luma(b, db), a.width, a.height) : kNaN;
  m.mae_lab = m.de76 = m.flip = kNaN;
  if (colour_meaning(a) == ColourMeaning::none || colour_meaning(b) == ColourMeaning::none) return m;
  const CodeTables ta = code_tables(a.type, a.colour_space), tb = code_tables(b.type, b.colour_space);
  const CodeView va = code_view(a, ta), vb = code_view(b, tb);
  if (options.mae_lab) {
    const LabDifference lab = lab_difference(va, vb);
    m.mae_lab = lab.mae;
    m.de76 = lab.de76;
  }
  if (options.flip) m.flip = flip_by_rows(va, vb, flip_filters());
  return m;
}

}  // namespace btfc
