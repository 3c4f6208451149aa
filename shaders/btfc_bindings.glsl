// The bindings of this project's own entry points, and of engines that have none of their own: one texture, one map.
//
//   set 0, bindings 0 to 3   storage buffers: word arrays 0 to 3 (where the model has none, any buffer)
//   set 0, binding 4         uniform buffer: the map's parameters, 32 words
//   constants 16 + i         parameter i, where a pipeline is made for one file; BTFC_UNSET: from the buffer
#ifndef BTFC_BINDINGS_GLSL
#define BTFC_BINDINGS_GLSL

layout(std430, set = 0, binding = 0) readonly buffer BtfcWords0 { uint btfc_words0[]; };
layout(std430, set = 0, binding = 1) readonly buffer BtfcWords1 { uint btfc_words1[]; };
layout(std430, set = 0, binding = 2) readonly buffer BtfcWords2 { uint btfc_words2[]; };
layout(std430, set = 0, binding = 3) readonly buffer BtfcWords3 { uint btfc_words3[]; };
layout(std140, set = 0, binding = 4) uniform BtfcParams { uvec4 btfc_params[8]; };

uint btfc_fetch(uint handle, uint slot, uint index) {
  if (slot == 0u) return btfc_words0[index];
  if (slot == 1u) return btfc_words1[index];
  if (slot == 2u) return btfc_words2[index];
  return btfc_words3[index];
}

uint btfc_fetch_size(uint handle, uint slot) {
  if (slot == 0u) return uint(btfc_words0.length());
  if (slot == 1u) return uint(btfc_words1.length());
  if (slot == 2u) return uint(btfc_words2.length());
  return uint(btfc_words3.length());
}

// A constant that is not set.
const uint BTFC_UNSET = 0xffffffffu;
layout(constant_id = 16) const uint BTFC_P0 = BTFC_UNSET;
layout(constant_id = 17) const uint BTFC_P1 = BTFC_UNSET;
layout(constant_id = 18) const uint BTFC_P2 = BTFC_UNSET;
layout(constant_id = 19) const uint BTFC_P3 = BTFC_UNSET;
layout(constant_id = 20) const uint BTFC_P4 = BTFC_UNSET;
layout(constant_id = 21) const uint BTFC_P5 = BTFC_UNSET;
layout(constant_id = 22) const uint BTFC_P6 = BTFC_UNSET;
layout(constant_id = 23) const uint BTFC_P7 = BTFC_UNSET;
layout(constant_id = 24) const uint BTFC_P8 = BTFC_UNSET;
layout(constant_id = 25) const uint BTFC_P9 = BTFC_UNSET;
layout(constant_id = 26) const uint BTFC_P10 = BTFC_UNSET;
layout(constant_id = 27) const uint BTFC_P11 = BTFC_UNSET;
layout(constant_id = 28) const uint BTFC_P12 = BTFC_UNSET;
layout(constant_id = 29) const uint BTFC_P13 = BTFC_UNSET;
layout(constant_id = 30) const uint BTFC_P14 = BTFC_UNSET;
layout(constant_id = 31) const uint BTFC_P15 = BTFC_UNSET;
layout(constant_id = 32) const uint BTFC_P16 = BTFC_UNSET;
layout(constant_id = 33) const uint BTFC_P17 = BTFC_UNSET;
layout(constant_id = 34) const uint BTFC_P18 = BTFC_UNSET;
layout(constant_id = 35) const uint BTFC_P19 = BTFC_UNSET;
layout(constant_id = 36) const uint BTFC_P20 = BTFC_UNSET;
layout(constant_id = 37) const uint BTFC_P21 = BTFC_UNSET;
layout(constant_id = 38) const uint BTFC_P22 = BTFC_UNSET;
layout(constant_id = 39) const uint BTFC_P23 = BTFC_UNSET;
layout(constant_id = 40) const uint BTFC_P24 = BTFC_UNSET;
layout(constant_id = 41) const uint BTFC_P25 = BTFC_UNSET;
layout(constant_id = 42) const uint BTFC_P26 = BTFC_UNSET;
layout(constant_id = 43) const uint BTFC_P27 = BTFC_UNSET;
layout(constant_id = 44) const uint BTFC_P28 = BTFC_UNSET;
layout(constant_id = 45) const uint BTFC_P29 = BTFC_UNSET;
layout(constant_id = 46) const uint BTFC_P30 = BTFC_UNSET;
layout(constant_id = 47) const uint BTFC_P31 = BTFC_UNSET;

const uvec4 BTFC_BAKED0 = uvec4(BTFC_P0, BTFC_P1, BTFC_P2, BTFC_P3);
const uvec4 BTFC_BAKED1 = uvec4(BTFC_P4, BTFC_P5, BTFC_P6, BTFC_P7);
const uvec4 BTFC_BAKED2 = uvec4(BTFC_P8, BTFC_P9, BTFC_P10, BTFC_P11);
const uvec4 BTFC_BAKED3 = uvec4(BTFC_P12, BTFC_P13, BTFC_P14, BTFC_P15);
const uvec4 BTFC_BAKED4 = uvec4(BTFC_P16, BTFC_P17, BTFC_P18, BTFC_P19);
const uvec4 BTFC_BAKED5 = uvec4(BTFC_P20, BTFC_P21, BTFC_P22, BTFC_P23);
const uvec4 BTFC_BAKED6 = uvec4(BTFC_P24, BTFC_P25, BTFC_P26, BTFC_P27);
const uvec4 BTFC_BAKED7 = uvec4(BTFC_P28, BTFC_P29, BTFC_P30, BTFC_P31);

// Folds away: every index is a literal.
uint btfc_param(uint handle, uint index) {
  uvec4 low = index < 8u ? (index < 4u ? BTFC_BAKED0 : BTFC_BAKED1) : (index < 12u ? BTFC_BAKED2 : BTFC_BAKED3);
  uvec4 high = index < 24u ? (index < 20u ? BTFC_BAKED4 : BTFC_BAKED5) : (index < 28u ? BTFC_BAKED6 : BTFC_BAKED7);
  uint baked = (index < 16u ? low : high)[index & 3u];
  return baked != BTFC_UNSET ? baked : btfc_params[index >> 2u][index & 3u];
}

#endif
