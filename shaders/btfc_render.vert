// A vertex of a shape that btfc_render.frag lights.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "btfc_render.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tangent;
layout(location = 3) in vec2 uv;

layout(location = 0) out vec3 world_position;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec3 world_tangent;
layout(location = 3) out vec2 texture_uv;

void main() {
  world_position = vec3(scene.world_from_object * vec4(position, 1.0));
  world_normal = mat3(scene.world_from_object) * normal;
  world_tangent = mat3(scene.world_from_object) * tangent;
  texture_uv = uv;
  gl_Position = scene.clip_from_object * vec4(position, 1.0);
}
