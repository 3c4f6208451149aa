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

// A stored code of type `from` (unorm8, unorm16, float16) as a sample of type `to`.
inline void store_code(btfc_sample from, std::uint32_t code, btfc_sample to, std::uint8_t* out) {
  const auto put16 = [&](std::uint32_t v) {
    const auto half_word = static_cast<std::uint16_t>(v);
    std::memcpy(out, &half_word, 2);
  };
  if (to == from) {
    if (to == BTFC_UNORM8)
      *out = static_cast<std::uint8_t>(code);
    else
      put16(code);
    return;
  }
  const float value = btfc_code_value(static_cast<uint>(from), code);
  switch (to) {
    case BTFC_FLOAT32:
      std::memcpy(out, &value, 4);
      return;
    case BTFC_FLOAT16:
      put16(btfc_float_to_half(value));
      return;
    case BTFC_UNORM8:
      *out = static_cast<std::uint8_t>(from == BTFC_UNORM16 ? (255u * code + 32767u) / 65535u
                                                            : to_unorm(value, 255.0f));
      return;
    case BTFC_UNORM16:
      put16(from == BTFC_UNORM8 ? 257u * code : to_unorm(value, 65535.0f));
      return;
  }
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

// The code that a value of a stored type came from: exact, since c / 255, c / 65535 and halves are apart in
// binary32.
inline std::uint32_t code_of(btfc_sample type, float value) {
  if (type == BTFC_UNORM8) return to_unorm(value, 255.0f);
  if (type == BTFC_UNORM16) return to_unorm(value, 65535.0f);
  return btfc_float_to_half(value);
}

}  // namespace btfc
