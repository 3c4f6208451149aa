// Planes: 2-D arrays of texels inside a word slot (format/loaded_item.h). Codes come back as integers.
#ifndef BTFC_PLANE_H
#define BTFC_PLANE_H
#include "btfc_half.h"
#include "btfc_language.h"

BTFC_BEGIN

// Sample types, spec/registry.md.
const uint BTFC_CODE_UNORM8 = 0u;
const uint BTFC_CODE_UNORM16 = 1u;
const uint BTFC_CODE_FLOAT16 = 2u;

// The codes of one texel: texel number `texel` of a plane that begins at first_word of slot, texels of
// texel_bits (8, 16, 32 or 64), samples of sample_bits (8 or 16). Channels that the plane lacks are
// undefined.
BTFC_FN uvec4 btfc_plane_codes(BTFC_WORDS words, uint slot, uint first_word, uint texel_bits,
                               uint sample_bits, uint texel) {
  if (texel_bits == 64u) {
    uint lo = btfc_word(words, slot, first_word + 2u * texel);
    uint hi = btfc_word(words, slot, first_word + 2u * texel + 1u);
    return uvec4(lo & 0xffffu, lo >> 16u, hi & 0xffffu, hi >> 16u);
  }
  uint texels_log2 = texel_bits == 32u ? 0u : (texel_bits == 16u ? 1u : 2u);  // texels a word
  uint word = btfc_word(words, slot, first_word + (texel >> texels_log2));
  uint bits = word >> ((texel & ((1u << texels_log2) - 1u)) * texel_bits);
  if (sample_bits == 8u) return uvec4(bits & 0xffu, (bits >> 8u) & 0xffu, (bits >> 16u) & 0xffu, bits >> 24u);
  return uvec4(bits & 0xffffu, bits >> 16u, 0u, 0u);
}

// One code as a number (spec/btfc.md section 6).
BTFC_FN float btfc_code_value(uint sample_type, uint code) {
  if (sample_type == BTFC_CODE_UNORM8) return float(code) / 255.0f;
  if (sample_type == BTFC_CODE_UNORM16) return float(code) / 65535.0f;
  return btfc_half_to_float(code);
}

BTFC_FN vec4 btfc_code_values(uint sample_type, BTFC_IN(uvec4) codes) {
  return vec4(btfc_code_value(sample_type, codes.x), btfc_code_value(sample_type, codes.y),
              btfc_code_value(sample_type, codes.z), btfc_code_value(sample_type, codes.w));
}

BTFC_END
#endif
