// Compute entry point, a prepare pass of models car, gmrf and car3d: an invocation collapses one texel of a
// level into the atlas. A workgroup's z is a unit and one of its factors.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "btfc_field_bindings.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
  FieldParams p = field_params(0u);
  FieldAtlasLevel a = field_atlas_level(p, push.level);
  uint factors = field_unit_factors(p), unit = gl_WorkGroupID.z / factors;
  FieldUnit u = field_unit(0u, p, a, push.level, push.unit + unit);
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= u.width || at.y >= u.height) return;
  uint first = unit * field_unit_words(0u, p, a, push.level);
  field_collapse_texel(0u, 0u, p, a, u, push.level, first, gl_WorkGroupID.z % factors, at.x, at.y);
}
