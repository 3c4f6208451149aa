// Texture coordinates, directions and footprints as a shader gets them, of whatever bits, made into queries
// (spec/shaders.md section 3).
#ifndef BTFC_UV_H
#define BTFC_UV_H
#include "btfc_language.h"
#include "btfc_math.h"
#include "btfc_query.h"

BTFC_BEGIN

// How a texture goes on beyond its border.
const uint BTFC_CLAMP = 0u;
const uint BTFC_REPEAT = 1u;
const uint BTFC_UNBOUNDED = 2u;

const float BTFC_MOST_PLACE = 2147483520.0f;  // the largest float below 2^31

// On the bits: a compiler may take it for granted that there is no NaN.
BTFC_FN bool btfc_finite(float f) { return (floatBitsToUint(f) & 0x7f800000u) != 0x7f800000u; }

// A direction that is no number or infinite counts as the normal.
BTFC_FN vec3 btfc_finite_direction(BTFC_IN(vec3) d) {
  return btfc_finite(d.x) && btfc_finite(d.y) && btfc_finite(d.z) ? d : vec3(0.0f, 0.0f, 1.0f);
}

// Texels, 1 … 2^20; what is no number counts as 1.
BTFC_FN float btfc_finite_footprint(float footprint) {
  if (!btfc_finite(footprint) || !(footprint > 1.0f)) return 1.0f;
  return footprint < BTFC_MOST_FOOTPRINT ? footprint : BTFC_MOST_FOOTPRINT;
}

// Texels from the texture's border along an axis: within 0 … size, of unbounded textures within ±2^31. What
// is no number or infinite counts as 0.
BTFC_FN float btfc_place(float uv, uint size, uint wrap) {
  float u = btfc_finite(uv) ? uv : 0.0f;
  if (wrap == BTFC_REPEAT) u = u - floor(u);
  if (wrap == BTFC_CLAMP) u = u > 0.0f ? (u < 1.0f ? u : 1.0f) : 0.0f;
  float place = u * float(size);
  return place > -BTFC_MOST_PLACE ? (place < BTFC_MOST_PLACE ? place : BTFC_MOST_PLACE) : -BTFC_MOST_PLACE;
}

// The texel that holds a place. One beyond the border is for the query's wrapping to bring back.
BTFC_FN int btfc_place_texel(float place) {
  float p = floor(place);
  return int(p > -BTFC_MOST_PLACE ? (p < BTFC_MOST_PLACE ? p : BTFC_MOST_PLACE) : -BTFC_MOST_PLACE);
}

BTFC_END
#endif
