// Model ptm: R_v(r, i) = a0 u^2 + a1 v^2 + a2 u v + a3 u + a4 v + a5 (survey, eq. 2; spec/models/ptm.md
// section 4).
#ifndef BTFC_PTM_H
#define BTFC_PTM_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_light.h"
#include "../btfc_query.h"

BTFC_BEGIN

// One map's parameters. Slot 0: direction tables, scales; slots 1 to 3: a row a view and texel.
struct PtmParams {
  uint width;  // texels
  uint height;
  uint wrap_u;
  uint wrap_v;
  uint channels;       // of the map
  uint first_channel;  // among those of all maps
  uint all_channels;
  uint terms;       // 1, 3 or 6, in the order of levels: a5, a3, a4, a0, a1, a2
  uint views_word;  // where the table begins in slot 0
  uint scale_word;  // channel c of term k of view v has scale (v terms + k) all_channels + c
  uint precision_code;
  uint rows_per_slot;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
PtmParams ptm_params(uint handle) {
  PtmParams p = PtmParams(BTFC_P4(0u), BTFC_P4(4u), BTFC_P4(8u));
  p.channels = btfc_bound(p.channels, 4u);
  p.terms = btfc_bound(p.terms, 6u);
  p.rows_per_slot = btfc_least(p.rows_per_slot, 1u);
  return p;
}
#endif

// All that a texel's value needs to know of its directions.
struct PtmState {
  uvec3 view;
  vec3 weight;
  vec3 low;   // what multiplies a5, a3, a4
  vec3 high;  // a0, a1, a2
};

BTFC_FN PtmState ptm_begin(BTFC_WORDS words, BTFC_IN(PtmParams) p, BTFC_IN(BtfcQuery) query) {
  BtfcCorners corners = btfc_corners(words, p.views_word, query.view);
  vec3 light = btfc_upper_unit(query.light);
  float u = light.x, v = light.y;
  PtmState state;
  state.view = corners.index;
  state.weight = corners.weight;
  state.low = vec3(1.0f, u, v);
  state.high = vec3(u * u, v * v, u * v);
  return state;
}

// texel: its number in rows from the top.
BTFC_FN vec4 ptm_texel(BTFC_WORDS words, BTFC_IN(PtmParams) p, BTFC_IN(PtmState) state, uint texel) {
  vec4 value = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 3; ++i) {
    if (state.weight[i] == 0.0f) continue;
    uint view = state.view[i];
    uint row = view * (p.width * p.height) + texel;
    uint slot = 1u + row / p.rows_per_slot;
    uint first = row % p.rows_per_slot * p.terms * p.all_channels + p.first_channel;
    uint scales = view * p.terms * p.all_channels + p.first_channel;
    for (uint c = 0u; c < p.channels; ++c) {
      float sum = 0.0f;
      for (uint k = 0u; k < p.terms; ++k) {
        vec2 scale = btfc_scale(words, p.scale_word, scales + k * p.all_channels + c);
        float element = btfc_element(words, slot, 0u, p.precision_code, first + k * p.all_channels + c);
        float factor = k < 3u ? state.low[int(k)] : state.high[int(k) - 3];
        sum += factor * (scale.x + scale.y * element);
      }
      value[int(c)] += state.weight[i] * sum;
    }
  }
  return value;
}

BTFC_FN vec4 ptm_eval(BTFC_WORDS words, BTFC_IN(PtmParams) p, BTFC_IN(BtfcQuery) query) {
  uint texel = btfc_texel(query.texel, p.width, p.height, p.wrap_u, p.wrap_v);
  return ptm_texel(words, p, ptm_begin(words, p, query), texel);
}

BTFC_END
#endif
