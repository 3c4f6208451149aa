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

// A query of the image.
struct Listed {
  uvec4 place;
  vec3 view, light;
};

Listed listed(uvec2 at) {
  ivec2 first = ivec2(int(3u * at.x), int(at.y));
  return Listed(imageLoad(queries, first), uintBitsToFloat(imageLoad(queries, first + ivec2(1, 0)).xyz),
                uintBitsToFloat(imageLoad(queries, first + ivec2(2, 0)).xyz));
}

#ifdef DECODE_SAMPLES
// Arguments of btfc_sample: (u, v, free, footprint) in place of (x, y, …).
vec4 decode_value(uvec2 at) {
  Listed own = listed(at);
  vec4 place = uintBitsToFloat(own.place);
  return btfc_sample(0u, place.xy, own.view, own.light, place.w);
}
#else
vec4 decode_value(uvec2 at) {
  ivec2 texel = ivec2(uvec2(push.origin) + at);  // wraps, as coordinates do
  BtfcQuery query = BtfcQuery(texel, push.level, push.view.xyz, push.light.xyz, push.view.w);
  if (push.source == DECODE_QUERIES) {
    Listed own = listed(at);
    query = BtfcQuery(ivec2(own.place.xy), own.place.z, own.view, own.light, uintBitsToFloat(own.place.w));
  }
  return btfc_eval(0u, query);
}
#endif

#endif
