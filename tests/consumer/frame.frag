// A sphere that wears a btfc texture, lit from above: what an engine's material shader does with btfc.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "btfc_bindings.glsl"
#include "btfc.glsl"

layout(constant_id = 3) const uint CHANNELS = 3u;  // of the map

layout(location = 0) out vec4 colour;

void main() {
  vec2 p = gl_FragCoord.xy / 128.0 - 1.0;
  p.y = -p.y;
  float above = 1.0 - dot(p, p);
  vec3 normal = vec3(p, sqrt(max(above, 1e-4)));
  vec3 tangent = normalize(vec3(normal.z, 0.0, -normal.x));  // where u grows
  vec3 bitangent = cross(normal, tangent);                   // where v falls
  mat3 frame = mat3(tangent, bitangent, normal);
  vec2 uv = vec2(8.0, -4.0) * vec2(atan(normal.x, normal.z), asin(normal.y)) / 3.14159265;
  float footprint = max(length(dFdx(uv)), length(dFdy(uv))) * float(btfc_extent(0u).width);
  vec3 view = vec3(0.0, 0.0, 1.0), light = normalize(vec3(0.4, 0.7, 0.6));
  vec4 value = btfc_sample(0u, fract(uv), view * frame, light * frame, footprint);
  vec3 lit = (CHANNELS < 3u ? value.rrr : value.rgb) * max(dot(normal, light), 0.0);
  colour = vec4(above > 0.0 ? lit : vec3(0.1), 1.0);
}
