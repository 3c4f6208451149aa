// Model plm: R_v(r, i) = sum_j b_vij Y^j with Y = rho (a1 u1 + a2 u2 + a3 u3)^n of the view and texel
// (survey, eqs. 3 and 4; spec/models/plm.md section 4).
#ifndef BTFC_PLM_H
#define BTFC_PLM_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_light.h"
#include "../btfc_math.h"
#include "../btfc_query.h"

BTFC_BEGIN

const uint BTFC_PLM_TERMS = 5u;                   // of the polynomial; and parameters of a lobe
const float BTFC_PLM_LEAST_BASE = 9.094947e-13f;  // 2^-40: what is not above it counts as turned away
const float BTFC_PLM_MOST_EXPONENT = 64.0f;
const float BTFC_PLM_MOST = 65536.0f;  // bounds |Y|, so that its fifth power stays finite

// One map's parameters. Slot 0: direction tables, scales, polynomials, codebooks; slots 1 to 3: a row a view
// and texel.
struct PlmParams {
  uint width;  // texels
  uint height;
  uint wrap_u;
  uint wrap_v;
  uint channels;       // of the map
  uint first_channel;  // among those of all maps
  uint all_channels;
  uint clusters;     // entries of a codebook; 0: the rows hold the parameters themselves
  uint polynomials;  // 0: Y is the answer
  uint views_word;   // where tables begin in slot 0
  uint lights_word;
  uint pairs_word;
  uint light_count;
  uint lobe_scale_word;  // parameter m, channel c of view v has scale (v 5 + m) all_channels + c
  uint term_scale_word;  // b_j, channel c: scale (j - 1) all_channels + c
  uint term_word;        // of a pair: 5 all_channels elements
  uint book_word;        // of a view and entry: 5 all_channels elements
  uint lobe_precision;
  uint term_precision;
  uint rows_per_slot;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
PlmParams plm_params(uint handle) {
  PlmParams p = PlmParams(BTFC_P16(0u), BTFC_P4(16u));
  p.channels = btfc_bound(p.channels, 4u);
  p.rows_per_slot = btfc_least(p.rows_per_slot, 1u);
  return p;
}
#endif

// All that a texel's value needs to know of its directions.
struct PlmState {
  uvec3 view;
  vec3 weight;
  vec3 light;
  float terms[60];  // of corner i, channel c of the map: 5 from (4 i + c) 5
};

// rho (a . u)^n. Finite whatever the parameters, as long as they are within 2^32.
BTFC_FN float btfc_lobe(float rho, BTFC_IN(vec3) a, float n, BTFC_IN(vec3) u) {
  float base = a.x * u.x + a.y * u.y + a.z * u.z;
  if (!(base > BTFC_PLM_LEAST_BASE)) return 0.0f;
  float exponent = n * btfc_log2(base);
  float value = rho * btfc_exp2(exponent < BTFC_PLM_MOST_EXPONENT ? exponent : BTFC_PLM_MOST_EXPONENT);
  return value < -BTFC_PLM_MOST ? -BTFC_PLM_MOST : (value > BTFC_PLM_MOST ? BTFC_PLM_MOST : value);
}

// sum_j b_j y^j, j = 1 … 5, by Horner's rule.
BTFC_FN float btfc_lobe_polynomial(float b1, float b2, float b3, float b4, float b5, float y) {
  return ((((b5 * y + b4) * y + b3) * y + b2) * y + b1) * y;
}

BTFC_FN PlmState plm_begin(BTFC_WORDS words, BTFC_IN(PlmParams) p, BTFC_IN(BtfcQuery) query) {
  BtfcCorners views = btfc_corners(words, p.views_word, query.view);
  PlmState state;
  state.view = views.index;
  state.weight = views.weight;
  state.light = btfc_upper_unit(query.light);
  for (uint i = 0u; i < 60u; ++i) state.terms[i] = i % BTFC_PLM_TERMS == 0u ? 1.0f : 0.0f;
  if (p.polynomials == 0u) return state;
  BtfcCorners lights = btfc_corners(words, p.lights_word, query.light);
  for (int i = 0; i < 3; ++i) {
    if (state.weight[i] == 0.0f) continue;
    for (uint c = 0u; c < p.channels; ++c) {
      for (uint j = 0u; j < BTFC_PLM_TERMS; ++j) {
        uint row = j * p.all_channels + p.first_channel + c;
        vec2 scale = btfc_scale(words, p.term_scale_word, row);
        float sum = 0.0f;
        for (int l = 0; l < 3; ++l) {
          if (lights.weight[l] == 0.0f) continue;
          uint pair = btfc_pair(words, p.pairs_word, p.light_count, state.view[i], lights.index[l]);
          uint at = pair * BTFC_PLM_TERMS * p.all_channels + row;
          float element = btfc_element(words, 0u, p.term_word, p.term_precision, at);
          sum += lights.weight[l] * (scale.x + scale.y * element);
        }
        state.terms[(uint(i) * 4u + c) * BTFC_PLM_TERMS + j] = sum;
      }
    }
  }
  return state;
}

// Parameter m of a lobe whose elements begin at `first`.
BTFC_FN float plm_parameter(BTFC_WORDS words, BTFC_IN(PlmParams) p, uint slot, uint first_word, uint first,
                            uint view, uint channel, uint m) {
  vec2 scale = btfc_scale(words, p.lobe_scale_word, (view * 5u + m) * p.all_channels + channel);
  return scale.x +
         scale.y * btfc_element(words, slot, first_word, p.lobe_precision, first + m * p.all_channels);
}

// texel: its number in rows from the top.
BTFC_FN vec4 plm_texel(BTFC_WORDS words, BTFC_IN(PlmParams) p, BTFC_IN(PlmState) state, uint texel) {
  vec4 value = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 3; ++i) {
    if (state.weight[i] == 0.0f) continue;
    uint view = state.view[i];
    uint row = view * (p.width * p.height) + texel;
    uint row_slot = 1u + row / p.rows_per_slot;
    uint row_in_slot = row % p.rows_per_slot;
    for (uint c = 0u; c < p.channels; ++c) {
      uint channel = p.first_channel + c;
      uint slot = row_slot, first_word = 0u, first = row_in_slot * 5u * p.all_channels + channel;
      if (p.clusters > 0u) {
        uint entry = uint(btfc_element(words, row_slot, 0u, BTFC_U8, row_in_slot * p.all_channels + channel));
        slot = 0u;
        first_word = p.book_word;
        first = (view * p.clusters + entry) * 5u * p.all_channels + channel;
      }
      float rho = plm_parameter(words, p, slot, first_word, first, view, channel, 0u);
      vec3 a = vec3(plm_parameter(words, p, slot, first_word, first, view, channel, 1u),
                    plm_parameter(words, p, slot, first_word, first, view, channel, 2u),
                    plm_parameter(words, p, slot, first_word, first, view, channel, 3u));
      float n = plm_parameter(words, p, slot, first_word, first, view, channel, 4u);
      float y = btfc_lobe(rho, a, n, state.light);
      uint t = (uint(i) * 4u + c) * BTFC_PLM_TERMS;
      value[int(c)] +=
          state.weight[i] * btfc_lobe_polynomial(state.terms[t], state.terms[t + 1u], state.terms[t + 2u],
                                                 state.terms[t + 3u], state.terms[t + 4u], y);
    }
  }
  return value;
}

BTFC_FN vec4 plm_eval(BTFC_WORDS words, BTFC_IN(PlmParams) p, BTFC_IN(BtfcQuery) query) {
  uint texel = btfc_texel(query.texel, p.width, p.height, p.wrap_u, p.wrap_v);
  return plm_texel(words, p, plm_begin(words, p, query), texel);
}

BTFC_END
#endif
