// As btfc_decode.comp, of arguments of btfc_sample.
#version 460
#extension GL_GOOGLE_include_directive : require
#define DECODE_SAMPLES
#include "btfc_decode.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 6, rgba32f) uniform writeonly image2D values;

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= push.size.x || at.y >= push.size.y) return;
  imageStore(values, ivec2(at), decode_value(at));
}
