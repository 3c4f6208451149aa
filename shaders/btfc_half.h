// binary16 <-> binary32 in integer arithmetic: equal everywhere, where packHalf2x16's rounding is left open
// by GLSL and a device may flush subnormals.
#ifndef BTFC_HALF_H
#define BTFC_HALF_H
#include "btfc_language.h"

BTFC_BEGIN

// Exact. h holds 16 bits.
BTFC_FN float btfc_half_to_float(uint h) {
  uint sign = (h & 0x8000u) << 16u;
  uint exponent = (h >> 10u) & 31u;
  uint mantissa = h & 0x3ffu;
  if (exponent == 0u) {
    float magnitude = float(mantissa) * 5.9604644775390625e-08f;  // mantissa 2^-24, a normal binary32
    return uintBitsToFloat(sign | floatBitsToUint(magnitude));
  }
  if (exponent == 31u) return uintBitsToFloat(sign | 0x7f800000u | (mantissa << 13u));
  return uintBitsToFloat(sign | ((exponent + 112u) << 23u) | (mantissa << 13u));
}

// To nearest, ties to even; overflow gives infinity. f is no NaN.
BTFC_FN uint btfc_float_to_half(float f) {
  uint bits = floatBitsToUint(f);
  uint sign = (bits >> 16u) & 0x8000u;
  uint magnitude = bits & 0x7fffffffu;
  if (magnitude >= 0x477ff000u) return sign | 0x7c00u;  // 65520 and above
  if (magnitude >= 0x38800000u) {                       // normal halves: 2^-14 and above
    uint rounded = magnitude + 0x0fffu + ((magnitude >> 13u) & 1u);
    return sign | ((rounded >> 13u) - 0x1c000u);
  }
  if (magnitude < 0x33000000u) return sign;  // below 2^-25
  uint shift = 126u - (magnitude >> 23u);    // 14 … 24
  uint mantissa = (magnitude & 0x7fffffu) | 0x800000u;
  uint kept = mantissa >> shift;
  uint rest = mantissa & ((1u << shift) - 1u);
  uint half_way = 1u << (shift - 1u);
  if (rest > half_way || (rest == half_way && (kept & 1u) == 1u)) kept += 1u;
  return sign | kept;
}

BTFC_END
#endif
