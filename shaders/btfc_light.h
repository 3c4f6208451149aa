// The light of models that are formulas of it, not tables (spec/models/ptm.md section 4, plm.md section 4).
#ifndef BTFC_LIGHT_H
#define BTFC_LIGHT_H
#include "btfc_language.h"

BTFC_BEGIN

// The unit vector along a direction of any length, with z not below 0 beforehand, as btfc_project has it;
// nothing at all, and what is no number, counts as the normal.
BTFC_FN vec3 btfc_upper_unit(BTFC_IN(vec3) direction) {
  float x = direction.x, y = direction.y, z = direction.z > 0.0f ? direction.z : 0.0f;
  float length = sqrt(x * x + y * y + z * z);
  if (!(length > 1e-18f && length < 1e18f)) return vec3(0.0f, 0.0f, 1.0f);
  return vec3(x / length, y / length, z / length);
}

BTFC_END
#endif
