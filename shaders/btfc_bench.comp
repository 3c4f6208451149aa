// For measuring: texels through btfc_eval, or fetched from an RGBA8 image by the same workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "btfc_bindings.glsl"
#include "btfc.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 3) const uint BENCH_FETCHES = 0u;  // 1: from the image
layout(constant_id = 4) const uint BENCH_TEXELS = 1u;   // an invocation: its own, or so many random ones

layout(set = 0, binding = 5) uniform sampler2D image;
layout(set = 0, binding = 6, rgba32f) uniform writeonly image2D values;

layout(push_constant, std430) uniform Push {
  vec4 view;  // w: footprint
  vec4 light;
  uvec2 size;
  uvec2 texture_size;  // of a texture that ends: repeated over the image
} push;

vec4 bench_texel(uvec2 at) {
  if (BENCH_FETCHES != 0u) return texelFetch(image, ivec2(at), 0);
  return btfc_eval(0u, BtfcQuery(ivec2(at % push.texture_size), 0u, push.view.xyz, push.light.xyz, push.view.w));
}

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= push.size.x || at.y >= push.size.y) return;
  vec4 sum = vec4(0.0);
  if (BENCH_TEXELS == 1u) {
    sum = bench_texel(at);
  } else {
    for (uint i = 0u; i < BENCH_TEXELS; ++i) sum += bench_texel(field_hash(at.x, at.y, i).xy % push.size);
  }
  imageStore(values, ivec2(at), sum);
}
