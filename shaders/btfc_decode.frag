// Fragment entry point: one fragment decodes one query of one map into the colour attachment.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "btfc_decode.glsl"

layout(location = 0) out vec4 value;

void main() { value = decode_value(uvec2(gl_FragCoord.xy)); }
