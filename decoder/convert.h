// Conversions between sample types, as spec/btfc.md section 6 fixes them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "btfc/btfc.h"
#include "shaders/btfc_plane.h"

namespace btfc {

inline std::size_t bytes_of(btfc_sample sample) {
  return sample == BTFC_UNORM8 ? 1 : sample == BTFC_FLOAT32 ? 4 : 2;
}

inline std::uint32_t to_unorm(float value, float scale) {
  return static_cast<std::uint32_t>(std::clamp(value, 0.0f, 1.0f) * scale + 0.5f);
}

// A computed value as a sample: to 8 and 16 bits clamped and rounded, to half floats rounded and kept finite.
inline void store_value(float value, btfc_sample to, std::uint8_t* out) {
  if (to == BTFC_FLOAT32) {
    std::memcpy(out, &value, 4);
  } else if (to == BTFC_UNORM8) {
    *out = static_cast<std::uint8_t>(to_unorm(value, 255.0f));
  } else {
    const auto code = static_cast<std::uint16_t>(
        to == BTFC_UNORM16 ? to_unorm(value, 65535.0f)
                           : btfc_float_to_half(std::clamp(value, -65504.0f, 65504.0f)));
    std::memcpy(out, &code, 2);
  }
}

// A stored code of type `from` (unorm8, unorm16, float16) as a sample of type `to`: the same type unchanged,
// integers by integers, the rest by way of its value.
inline void store_code(btfc_sample from, std::uint32_t code, btfc_sample to, std::uint8_t* out) {
  if (to != from && from == BTFC_UNORM16 && to == BTFC_UNORM8) {
    code = (255u * code + 32767u) / 65535u;
  } else if (to != from && from == BTFC_UNORM8 && to == BTFC_UNORM16) {
    code *= 257u;
  } else if (to != from) {
    store_value(btfc_code_value(static_cast<uint>(from), code), to, out);
    return;
  }
  if (to == BTFC_UNORM8) {
    *out = static_cast<std::uint8_t>(code);
    return;
  }
  const auto half_word = static_cast<std::uint16_t>(code);
  std::memcpy(out, &half_word, 2);
}

// The code that a value of a stored type came from: exact, since c / 255, c / 65535 and halves are apart in
// binary32.
inline std::uint32_t code_of(btfc_sample type, float value) {
  if (type == BTFC_UNORM8) return to_unorm(value, 255.0f);
  if (type == BTFC_UNORM16) return to_unorm(value, 65535.0f);
  return btfc_float_to_half(value);
}

}  // namespace btfc
