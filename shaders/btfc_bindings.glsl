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

// Folds away: every index is a literal.
uint btfc_baked(uint index) {
  switch (index) {
    case 0u: return BTFC_P0;
    case 1u: return BTFC_P1;
    case 2u: return BTFC_P2;
    case 3u: return BTFC_P3;
    case 4u: return BTFC_P4;
    case 5u: return BTFC_P5;
    case 6u: return BTFC_P6;
    case 7u: return BTFC_P7;
    case 8u: return BTFC_P8;
    case 9u: return BTFC_P9;
    case 10u: return BTFC_P10;
    case 11u: return BTFC_P11;
    case 12u: return BTFC_P12;
    case 13u: return BTFC_P13;
    case 14u: return BTFC_P14;
    case 15u: return BTFC_P15;
    case 16u: return BTFC_P16;
    case 17u: return BTFC_P17;
    case 18u: return BTFC_P18;
    case 19u: return BTFC_P19;
    case 20u: return BTFC_P20;
    case 21u: return BTFC_P21;
    case 22u: return BTFC_P22;
    case 23u: return BTFC_P23;
    case 24u: return BTFC_P24;
    case 25u: return BTFC_P25;
    case 26u: return BTFC_P26;
    case 27u: return BTFC_P27;
    case 28u: return BTFC_P28;
    case 29u: return BTFC_P29;
    case 30u: return BTFC_P30;
    case 31u: return BTFC_P31;
  }
  return BTFC_UNSET;
}

uint btfc_param(uint handle, uint index) {
  uint baked = btfc_baked(index);
  return baked != BTFC_UNSET ? baked : btfc_params[index >> 2u][index & 3u];
}

#endif
