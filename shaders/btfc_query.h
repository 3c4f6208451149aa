// What is asked of a texture: one signature for all models.
#ifndef BTFC_QUERY_H
#define BTFC_QUERY_H
#include "btfc_language.h"

BTFC_BEGIN

// Footprints beyond count as this, texels.
const float BTFC_MOST_FOOTPRINT = 1048576.0f;

struct BtfcQuery {
  ivec2 texel;  // any; outside the texture the file's wrap rule applies
  uint level;   // 0 is full resolution; models without levels ignore it
  vec3 view;    // unit, away from the surface; models without directions ignore both
  vec3 light;
  float footprint;  // texels
};

// Spec/btfc.md section 6: a coordinate outside 0 … size-1 is clamped (wrap 0) or repeated (wrap 1).
BTFC_FN uint btfc_wrap(int coordinate, uint size, uint wrap) {
  if (coordinate >= 0 && uint(coordinate) < size) return uint(coordinate);
  if (wrap == 0u) return coordinate < 0 ? 0u : size - 1u;
  int remainder = coordinate % int(size);
  return uint(remainder < 0 ? remainder + int(size) : remainder);
}

// The number of a texel in rows from the top, wrapped or clamped into the texture.
BTFC_FN uint btfc_texel(BTFC_IN(ivec2) texel, uint width, uint height, uint wrap_u, uint wrap_v) {
  return btfc_wrap(texel.y, height, wrap_v) * width + btfc_wrap(texel.x, width, wrap_u);
}

BTFC_END
#endif
