// Elementary functions by polynomials, equal on CPU and GPU up to the last places of + and *: GLSL leaves the
// precision of its own loose. Coefficients after S. Moshier's Cephes library (single precision).
#ifndef BTFC_MATH_H
#define BTFC_MATH_H
#include "btfc_language.h"

#ifdef __cplusplus
#include <cmath>
namespace btfc {
using std::floor;
}
#endif

BTFC_BEGIN

const float BTFC_PI = 3.14159265f;
const float BTFC_LEAST_EXPONENT = -126.0f;

// 2^x, relative error below 2e-7 for -126 <= x <= 126; outside, the value at the nearer end.
BTFC_FN float btfc_exp2(float x) {
  float z = x < BTFC_LEAST_EXPONENT ? BTFC_LEAST_EXPONENT : (x > 126.0f ? 126.0f : x);
  // z + 128.5 is positive: the conversion cuts towards zero, on GPUs too.
  int whole = int(z + 128.5f) - 128;
  BTFC_PRECISE float f = z - float(whole);
  BTFC_PRECISE float p = 1.535336188319500e-4f;
  p = p * f + 1.339887440266574e-3f;
  p = p * f + 9.618437357674640e-3f;
  p = p * f + 5.550332471162809e-2f;
  p = p * f + 2.402264791363012e-1f;
  p = p * f + 6.931472028550421e-1f;
  p = p * f + 1.0f;
  return p * uintBitsToFloat(uint(whole + 127) << 23u);
}

// log2 x of normal x > 0, absolute error below 1e-6 beside the rounding of the result.
BTFC_FN float btfc_log2(float x) {
  uint bits = floatBitsToUint(x);
  int e = int(bits >> 23u) - 127;
  float m = uintBitsToFloat((bits & 0x7fffffu) | 0x3f800000u);  // 1 <= m < 2
  if (m > 1.41421356f) {
    m = 0.5f * m;
    e = e + 1;
  }
  BTFC_PRECISE float f = m - 1.0f;
  BTFC_PRECISE float p = 7.0376836292e-2f;
  p = p * f - 1.1514610310e-1f;
  p = p * f + 1.1676998740e-1f;
  p = p * f - 1.2420140846e-1f;
  p = p * f + 1.4249322787e-1f;
  p = p * f - 1.6668057665e-1f;
  p = p * f + 2.0000714765e-1f;
  p = p * f - 2.4999993993e-1f;
  p = p * f + 3.3333331174e-1f;
  BTFC_PRECISE float natural = f - 0.5f * f * f + f * f * f * p;
  return natural * 1.44269504f + float(e);
}

// sqrt x for x >= 0 by Newton's steps on 1/sqrt, products only.
BTFC_FN float btfc_sqrt(float x) {
  if (x < 1e-30f) return 0.0f;
  float r = uintBitsToFloat(0x5f375a86u - (floatBitsToUint(x) >> 1u));
  for (int i = 0; i < 4; i++) {
    BTFC_PRECISE float square = r * r;
    r = r * (1.5f - 0.5f * x * square);
  }
  return x * r;
}

// The angle of (x, y), y over x, -pi … pi; 0 at the origin. Absolute error below 4e-7.
BTFC_FN float btfc_atan2(float y, float x) {
  float ax = x < 0.0f ? -x : x;
  float ay = y < 0.0f ? -y : y;
  if (ax == 0.0f && ay == 0.0f) return 0.0f;
  bool steep = ay > ax;
  float t = steep ? ax / ay : ay / ax;  // 0 … 1
  float base = 0.0f;
  if (t > 0.41421356f) {  // tan 22.5 degrees
    base = 0.25f * BTFC_PI;
    t = (t - 1.0f) / (t + 1.0f);
  }
  BTFC_PRECISE float z = t * t;
  BTFC_PRECISE float p = 8.05374449538e-2f;
  p = p * z - 1.38776856032e-1f;
  p = p * z + 1.99777106478e-1f;
  p = p * z - 3.33329491539e-1f;
  BTFC_PRECISE float angle = base + (p * z * t + t);
  if (steep) angle = 0.5f * BTFC_PI - angle;
  if (x < 0.0f) angle = BTFC_PI - angle;
  return y < 0.0f ? -angle : angle;
}

BTFC_END
#endif
