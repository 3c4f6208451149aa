// A point of a textured surface under one light: what the viewer sees of it, linear, Rec. 709; lights add up.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "btfc_bindings.glsl"
#include "btfc.glsl"
#include "btfc_render.glsl"

layout(location = 0) in vec3 world_position;
layout(location = 1) in vec3 world_normal;
layout(location = 2) in vec3 world_tangent;
layout(location = 3) in vec2 texture_uv;

layout(location = 0) out vec4 radiance;

// A unit vector with z no less than `least`, its azimuth kept: directions below the lowest measured one count
// as that, so that no model is asked for what it has not seen.
vec3 not_below(vec3 d, float least) {
  if (d.z >= least) return d;
  float flat_length = length(d.xy);
  return vec3(d.xy * (flat_length > 0.0 ? sqrt(1.0 - least * least) / flat_length : 0.0), least);
}

vec3 linear_of_srgb(vec3 v) {
  return mix(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, lessThanEqual(v, vec3(0.04045)));
}

void main() {
  // Derivatives come first: all of a quad's invocations must meet them.
  BtfcExtent extent = btfc_extent(0u);
  vec2 size = vec2(extent.width, extent.height);
  float footprint = max(length(dFdx(texture_uv) * size), length(dFdy(texture_uv) * size));

  // x along growing u, y towards smaller v, z along the normal. Seen from behind, z alone changes sides: what
  // is raised on one side is raised on the other.
  vec3 z = normalize(world_normal);
  vec3 x = normalize(world_tangent - dot(world_tangent, z) * z);
  vec3 y = cross(z, x);
  if (!gl_FrontFacing) z = -z;
  vec3 to_viewer = normalize(scene.viewer.xyz - scene.viewer.w * world_position);
  vec3 to_light = light.direction.xyz;
  vec3 l = vec3(dot(to_light, x), dot(to_light, y), dot(to_light, z));
  vec3 v = vec3(dot(to_viewer, x), dot(to_viewer, y), dot(to_viewer, z));
  radiance = vec4(0.0, 0.0, 0.0, 1.0);
  if (l.z <= 0.0) return;

  vec2 uv = scene.cut_to_extent == 0u ? texture_uv : texture_uv - floor(texture_uv);
  vec4 value = btfc_sample(0u, uv, not_below(v, scene.least_view_z), not_below(l, scene.least_light_z), footprint);
  vec3 shown = scene.channels < 3u ? value.xxx : value.xyz;
  if (scene.srgb_coded != 0u) shown = linear_of_srgb(max(shown, 0.0));
  // Below the lowest measured light the reflectance stays, and the cosine goes on to fall.
  float cosine = scene.holds_cosine != 0u ? min(l.z / scene.least_light_z, 1.0) : l.z;
  radiance.xyz = max(shown, 0.0) * cosine * light.strength.xyz;
}
