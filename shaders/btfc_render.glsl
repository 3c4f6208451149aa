// What btfc_render.vert and .frag share: the scene.
//
//   set 0, binding 5   uniform buffer: RenderScene
//   push constants     RenderLight
#ifndef BTFC_RENDER_GLSL
#define BTFC_RENDER_GLSL

layout(std140, set = 0, binding = 5) uniform RenderScene {
  mat4 clip_from_object;
  mat4 world_from_object;  // a rotation
  vec4 viewer;             // in the world: its place and 1, or the direction towards it and 0
  float least_view_z;      // of the steepest view and light that the file was made from, in the surface's frame
  float least_light_z;
  uint channels;       // of the map
  uint srgb_coded;     // 1: values are decoded before they are lit
  uint holds_cosine;   // 1: values have the light's cosine in them
  uint cut_to_extent;  // 1: texture coordinates begin anew at each whole number
} scene;

// One light from far away.
layout(push_constant, std430) uniform RenderLight {
  vec4 direction;  // in the world, towards the light; unit
  vec4 strength;   // red, green, blue: irradiance over pi where it falls head-on
} light;

#endif
