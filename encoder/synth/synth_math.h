// Small arithmetic of the procedural materials: + - * / and square roots only, so that no libm shows in the
// codes.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "format/head.h"
#include "shaders/btfc_half.h"

namespace btfc::procedural {

struct Rgb {
  double r = 0, g = 0, b = 0;
};
inline Rgb operator*(const Rgb& c, double s) { return {c.r * s, c.g * s, c.b * s}; }
inline Rgb operator+(const Rgb& a, const Rgb& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
inline Rgb mix(const Rgb& a, const Rgb& b, double t) { return a * (1 - t) + b * t; }
inline double mix(double a, double b, double t) { return a * (1 - t) + b * t; }
inline double saturate(double v) { return std::min(std::max(v, 0.0), 1.0); }
inline double square(double v) { return v * v; }

// 0 below from, 1 above to, smooth between.
inline double step(double from, double to, double v) {
  const double t = saturate((v - from) / (to - from));
  return t * t * (3 - 2 * t);
}

// A quarter circle's rise: 0 at v <= 0, 1 at v >= width, steep first.
inline double rounded(double v, double width) { return std::sqrt(1 - square(1 - saturate(v / width))); }

// Sine and cosine for |x| below about 1e6, to 1e-11.
inline double sine(double x) {
  constexpr double kPi = 3.14159265358979323846;
  const double k = std::floor(x / kPi + 0.5), r = x - k * kPi, s = r * r;  // |r| <= pi / 2
  double sum = 1;
  for (int n = 16; n >= 2; n -= 2) sum = 1 - s / (n * (n + 1)) * sum;  // Taylor, to r^17
  return std::floor(k / 2) * 2 == k ? r * sum : -r * sum;
}
inline double cosine(double x) { return sine(x + 1.57079632679489661923); }

// The sRGB curve for v in 0 … 1. v^(1/2.4) as the root z of z^12 = v^5, by Newton's method from a close
// guess.
inline double srgb_code(double v) {
  if (v <= 0.0031308) return 12.92 * v;
  const double s1 = std::sqrt(v), s2 = std::sqrt(s1), s3 = std::sqrt(s2);
  double z = (0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * v + 0.055) / 1.055;
  const double v5 = square(square(v)) * v;
  for (int k = 0; k < 3; ++k) {
    const double z4 = square(square(z));
    z += (v5 / (z4 * z4 * z * z * z) - z) / 12;
  }
  return std::min(1.055 * z - 0.055, 1.0);
}

// The code of a linear value: the half, or the display-coded value in the type's range.
inline std::uint16_t encode(SampleType type, double linear) {
  if (type == SampleType::float16) {
    return static_cast<std::uint16_t>(
        btfc_float_to_half(static_cast<float>(std::clamp(linear, 0.0, 65504.0))));
  }
  const double top = type == SampleType::unorm8 ? 255 : 65535;
  return static_cast<std::uint16_t>(srgb_code(saturate(linear)) * top + 0.5);
}

}  // namespace btfc::procedural
