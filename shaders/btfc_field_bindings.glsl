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
uint btfc_bound(uint value, uint most) { return value; }
float field_scratch_load(uint memory, uint index) { return scratch[index]; }
void field_scratch_store(uint memory, uint index, float value) { scratch[index] = value; }
float field_atlas_load(uint memory, uint index) { return atlas[index]; }
void field_atlas_store(uint memory, uint index, float value) { atlas[index] = value; }

#include "models/field_prepare.h"

// One argument a field, in order: their number must be that of the struct, or this does not compile.
FieldParams field_params_of_ubo() {
  return FieldParams(params[0].x, params[0].y, params[0].z, params[0].w,
                     params[1].x, params[1].y, params[1].z, params[1].w,
                     params[2].x, params[2].y, params[2].z, params[2].w,
                     params[3].x, params[3].y, params[3].z, params[3].w,
                     params[4].x, params[4].y, params[4].z, params[4].w,
                     params[5].x, params[5].y, params[5].z, params[5].w,
                     params[6].x, params[6].y, params[6].z);
}

#endif
