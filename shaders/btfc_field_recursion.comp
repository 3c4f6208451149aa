// Compute entry point, a prepare pass of models car and car3d: a workgroup runs some steps of the recursion of
// one unit, its invocations rows in a wavefront, into the scratch.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "btfc_field_bindings.glsl"

layout(local_size_x = FIELD_LANES) in;

void main() {
  FieldParams p = field_params(0u);
  FieldAtlasLevel a = field_atlas_level(p, push.level);
  FieldUnit u = field_unit(0u, p, a, push.level, push.unit + gl_WorkGroupID.x);
  uint first = gl_WorkGroupID.x * field_unit_words(0u, p, a, push.level);
  FieldRun run = field_run(0u, p, a, u, push.level, first);
  FieldWalk walk = field_walk_begin(u, gl_LocalInvocationID.x, push.first_step);
  for (uint step = 0u; step < push.steps; ++step) {
    if (field_walk_inside(u, walk)) field_recursion(0u, 0u, p, u, run, uint(walk.x), walk.y);
    field_walk_on(walk);
    memoryBarrierBuffer();
    barrier();
  }
}
