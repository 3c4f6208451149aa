// As btfc_decode.frag, of arguments of btfc_sample.
#version 460
#extension GL_GOOGLE_include_directive : require
#define DECODE_SAMPLES
#include "btfc_decode.glsl"

layout(location = 0) out vec4 value;

void main() { value = decode_value(uvec2(gl_FragCoord.xy)); }
