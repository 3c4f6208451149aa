// What the entry points btfc_decode.comp and .frag share: where queries come from.
//
//   set 0, binding 5   storage image rgba32ui: queries, three texels each: (x, y, level, footprint), view, light; x, y,
//                      level as integers, all else as the bits of floats
#ifndef BTFC_DECODE_GLSL
#define BTFC_DECODE_GLSL
#include "btfc_bindings.glsl"
#include "btfc.glsl"

layout(set = 0, binding = 5, rgba32ui) uniform readonly uimage2D queries;

const uint DECODE_RECTANGLE = 0u;  // a rectangle, all under the same directions
const uint DECODE_QUERIES = 1u;    // of the image: each its own

layout(push_constant, std430) uniform Push {
  vec4 view;    // w: footprint
  vec4 light;
  ivec2 origin;  // texel of the rectangle's top left
  uvec2 size;
  uint level;
  uint source;
} push;

#ifdef DECODE_SAMPLES
// Arguments of btfc_sample: (u, v, free, footprint) in place of (x, y, …).
vec4 decode_value(uvec2 at) {
  ivec2 first = ivec2(int(3u * at.x), int(at.y));
  vec4 place = uintBitsToFloat(imageLoad(queries, first));
  vec3 view = uintBitsToFloat(imageLoad(queries, first + ivec2(1, 0)).xyz);
  vec3 light = uintBitsToFloat(imageLoad(queries, first + ivec2(2, 0)).xyz);
  return btfc_sample(0u, place.xy, view, light, place.w);
}
#else
vec4 decode_value(uvec2 at) {
  ivec2 texel = ivec2(uvec2(push.origin) + at);  // wraps, as coordinates do
  BtfcQuery query = BtfcQuery(texel, push.level, push.view.xyz, push.light.xyz, push.view.w);
  if (push.source == DECODE_QUERIES) {
    ivec2 first = ivec2(int(3u * at.x), int(at.y));
    uvec4 place = imageLoad(queries, first);
    vec3 view = uintBitsToFloat(imageLoad(queries, first + ivec2(1, 0)).xyz);
    vec3 light = uintBitsToFloat(imageLoad(queries, first + ivec2(2, 0)).xyz);
    query = BtfcQuery(ivec2(place.xy), place.z, view, light, uintBitsToFloat(place.w));
  }
  return btfc_eval(0u, query);
}
#endif

#endif
