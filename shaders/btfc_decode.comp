// Compute entry point: one invocation decodes one texel of one map into four floats.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, set = 0, binding = 0) readonly buffer Words0 { uint words0[]; };
layout(std430, set = 0, binding = 1) readonly buffer Words1 { uint words1[]; };
layout(std430, set = 0, binding = 2) readonly buffer Words2 { uint words2[]; };
layout(std430, set = 0, binding = 3) readonly buffer Words3 { uint words3[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Values { vec4 values[]; };

uint btfc_word(uint handle, uint slot, uint index) {
  if (slot == 0u) return words0[index];
  if (slot == 1u) return words1[index];
  if (slot == 2u) return words2[index];
  return words3[index];
}

#include "models/patch.h"

layout(push_constant, std430) uniform Push { PatchParams params; } push;

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= push.params.width || at.y >= push.params.height) return;
  BtfcQuery query = BtfcQuery(ivec2(at), 0u, vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 1.0), 0.0);
  values[at.y * push.params.width + at.x] = patch_eval(0u, push.params, query);
}
