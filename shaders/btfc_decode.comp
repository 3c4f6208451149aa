// Compute entry point: one invocation decodes one texel of one map under a pair of directions into four
// floats. Compiled once a model, with BTFC_MODEL_<id> defined.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, set = 0, binding = 0) readonly buffer Words0 { uint words0[]; };
layout(std430, set = 0, binding = 1) readonly buffer Words1 { uint words1[]; };
layout(std430, set = 0, binding = 2) readonly buffer Words2 { uint words2[]; };
layout(std430, set = 0, binding = 3) readonly buffer Words3 { uint words3[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Values { vec4 values[]; };

uint btfc_word(uint handle, uint slot, uint index) {
  if (slot == 0u) return words0[index];
  if (slot == 1u) return words1[index];
  if (slot == 2u) return words2[index];
  return words3[index];
}

// The eval dispatch: a row a model.
#if defined(BTFC_MODEL_patch)
#include "models/patch.h"
#define BTFC_PARAMS PatchParams
#define BTFC_EVAL patch_eval
#elif defined(BTFC_MODEL_ptm)
#include "models/ptm.h"
#define BTFC_PARAMS PtmParams
#define BTFC_EVAL ptm_eval
#elif defined(BTFC_MODEL_plm)
#include "models/plm.h"
#define BTFC_PARAMS PlmParams
#define BTFC_EVAL plm_eval
#elif defined(BTFC_MODEL_pcarf)
#include "models/pcarf.h"
#define BTFC_PARAMS PcarfParams
#define BTFC_EVAL pcarf_eval
#elif defined(BTFC_MODEL_pca)
#include "models/pca.h"
#define BTFC_PARAMS PcaParams
#define BTFC_EVAL pca_eval
#elif defined(BTFC_MODEL_gm)
#include "models/gm.h"
#define BTFC_PARAMS GmParams
#define BTFC_EVAL gm_eval
#elif defined(BTFC_MODEL_car) || defined(BTFC_MODEL_gmrf) || defined(BTFC_MODEL_car3d)
#include "models/field.h"
#define BTFC_PARAMS FieldParams
#define BTFC_EVAL field_eval
#elif defined(BTFC_MODEL_lpca)
#include "models/lpca.h"
#define BTFC_PARAMS LpcaParams
#define BTFC_EVAL lpca_eval
#endif

// Both directions as unit vectors; w of view: the footprint in texels.
layout(push_constant, std430) uniform Push {
  vec4 view;
  vec4 light;
  BTFC_PARAMS params;
} push;

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= push.params.width || at.y >= push.params.height) return;
  BtfcQuery query = BtfcQuery(ivec2(at), 0u, push.view.xyz, push.light.xyz, push.view.w);
  values[at.y * push.params.width + at.x] = BTFC_EVAL(0u, push.params, query);
}
