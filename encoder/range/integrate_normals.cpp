// Frankot and Chellappa, "A method for enforcing integrability in shape from shading algorithms", 1988.
#include "encoder/range/integrate_normals.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "encoder/linear/matrix.h"
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <unsupported/Eigen/FFT>
#pragma GCC diagnostic pop

namespace btfc {
namespace {

using Wave = std::complex<double>;

enum class Sense { forward, inverse };

// Of any length. Eigen's plans are kept in the object, one thread at a time.
class Plane {
 public:
  Plane(std::size_t width, std::size_t height) : width_(width), height_(height) {}

  // Rows, then columns; the inverse divides by their number.
  void transform(std::vector<Wave>& values, Sense sense) {
    line(values, width_, 1, height_, width_, sense);
    line(values, height_, width_, width_, 1, sense);
  }

 private:
  void line(std::vector<Wave>& values, std::size_t length, std::size_t step, std::size_t count,
            std::size_t stride, Sense sense) {
    if (length == 1) return;
    in_.resize(length);
    out_.resize(length);
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < length; ++i) in_[i] = values[k * stride + i * step];
      if (sense == Sense::forward) {
        fft_.fwd(out_.data(), in_.data(), as_index(length));
      } else {
        fft_.inv(out_.data(), in_.data(), as_index(length));
      }
      for (std::size_t i = 0; i < length; ++i) values[k * stride + i * step] = out_[i];
    }
  }

  std::size_t width_, height_;
  Eigen::FFT<double> fft_;
  std::vector<Wave> in_, out_;
};

// Of wave k of n, radians a texel, the shortest one positive.
std::vector<double> frequencies(std::size_t n) {
  std::vector<double> w(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double waves = 2 * k <= n ? static_cast<double>(k) : -static_cast<double>(n - k);
    w[k] = 2 * std::numbers::pi * waves / static_cast<double>(n);
  }
  return w;
}

struct Slopes {
  std::vector<Wave> p, q;
};

// Clamped; less the mean of the known ones, unknown ones 0.
Slopes slopes_of(std::span<const TexelSurface> surface) {
  Slopes s{std::vector<Wave>(surface.size()), std::vector<Wave>(surface.size())};
  double p_sum = 0, q_sum = 0, count = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    if (!surface[i].known) continue;
    const auto [x, y, z] = surface[i].normal;
    const auto slope = [z = static_cast<double>(z)](double v) {
      return std::clamp(v / std::max(z, 1e-6), -kMostSlope, kMostSlope);
    };
    s.p[i] = slope(-static_cast<double>(x));
    s.q[i] = slope(static_cast<double>(y));
    p_sum += s.p[i].real();
    q_sum += s.q[i].real();
    count += 1;
  }
  if (count == 0) return s;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    if (!surface[i].known) continue;
    s.p[i] -= p_sum / count;
    s.q[i] -= q_sum / count;
  }
  return s;
}

}  // namespace

std::vector<float> integrate_normals(std::span<const TexelSurface> surface, std::uint32_t width,
                                     std::uint32_t height) {
  Slopes s = slopes_of(surface);
  Plane plane(width, height);
  plane.transform(s.p, Sense::forward);
  plane.transform(s.q, Sense::forward);
  const std::vector<double> u = frequencies(width), v = frequencies(height);
  std::vector<Wave>& h = s.p;
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      const double square = u[x] * u[x] + v[y] * v[y];
      const Wave sum = u[x] * s.p[i] + v[y] * s.q[i];  // -i sum = (imaginary, -real)
      h[i] = square > 0 ? Wave(sum.imag() / square, -sum.real() / square) : Wave();
    }
  }
  plane.transform(h, Sense::inverse);
  // What the shortest waves' own derivative makes of them is imaginary, and dropped here.
  std::vector<float> out(h.size());
  for (std::size_t i = 0; i < h.size(); ++i) out[i] = static_cast<float>(h[i].real());
  return out;
}

}  // namespace btfc
