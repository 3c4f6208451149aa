// Elements of coded arrays inside a word slot (spec/tables.md section 5).
#ifndef BTFC_ARRAY_H
#define BTFC_ARRAY_H
#include "btfc_half.h"
#include "btfc_language.h"

BTFC_BEGIN

// Precisions, spec/registry.md.
const uint BTFC_F32 = 0u;
const uint BTFC_F16 = 1u;
const uint BTFC_U8 = 2u;

// Element `index` of the array that begins at first_word: a number, or with BTFC_U8 a code 0 … 255.
BTFC_FN float btfc_element(BTFC_WORDS words, uint slot, uint first_word, uint coding, uint index) {
  if (coding == BTFC_F32) return uintBitsToFloat(btfc_word(words, slot, first_word + index));
  if (coding == BTFC_F16) {
    uint word = btfc_word(words, slot, first_word + (index >> 1u));
    return btfc_half_to_float((word >> ((index & 1u) * 16u)) & 0xffffu);
  }
  return float((btfc_word(words, slot, first_word + (index >> 2u)) >> ((index & 3u) * 8u)) & 0xffu);
}

// What turns an element of a row into its value: offset + step * element. Two words a row in slot 0.
BTFC_FN vec2 btfc_scale(BTFC_WORDS words, uint first_word, uint row) {
  return vec2(uintBitsToFloat(btfc_word(words, 0u, first_word + 2u * row)),
              uintBitsToFloat(btfc_word(words, 0u, first_word + 2u * row + 1u)));
}

BTFC_END
#endif
