// What the prepare passes of the random fields are bound to: words, the atlas (word slot 2), a scratch, and
// FieldParams as words.
#ifndef BTFC_FIELD_BINDINGS_GLSL
#define BTFC_FIELD_BINDINGS_GLSL

layout(std430, set = 0, binding = 0) readonly buffer Words0 { uint words0[]; };
layout(std430, set = 0, binding = 1) readonly buffer Words1 { uint words1[]; };
layout(std430, set = 0, binding = 2) buffer Atlas { float atlas[]; };
// Invocations of a workgroup read what others have stored.
layout(std430, set = 0, binding = 3) coherent buffer Scratch { float scratch[]; };
layout(std140, set = 0, binding = 4) uniform Params { uvec4 params[8]; };

// unit: the first one of this dispatch, whose scratch begins at word 0. first_step, steps: of the recursion.
layout(push_constant, std430) uniform Push { uint level, unit, first_step, steps; } push;

// The passes read slots 0 and 1 alone.
uint btfc_word(uint handle, uint slot, uint index) { return slot == 0u ? words0[index] : words1[index]; }
uint btfc_param(uint handle, uint index) { return params[index >> 2u][index & 3u]; }
uint btfc_bound(uint value, uint most) { return value; }
uint btfc_least(uint value, uint least) { return value; }
float field_scratch_load(uint memory, uint index) { return scratch[index]; }
void field_scratch_store(uint memory, uint index, float value) { scratch[index] = value; }
float field_atlas_load(uint memory, uint index) { return atlas[index]; }
void field_atlas_store(uint memory, uint index, float value) { atlas[index] = value; }

#include "models/field_prepare.h"

#endif
