// Model pcarf: R_v(r, i) = mu_v(r) + sum_k alpha_vk(i) E_vk(r) (survey, eq. 5; spec/models/pcarf.md section
// 4).
#ifndef BTFC_PCARF_H
#define BTFC_PCARF_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_query.h"

BTFC_BEGIN

// One map's parameters. Slot 0: direction tables, scales, weights; slots 1 to 3: row view * texels + texel.
struct PcarfParams {
  uint width;  // texels
  uint height;
  uint wrap_u;
  uint wrap_v;
  uint channels;       // of the map
  uint first_channel;  // among those of all maps
  uint all_channels;
  uint rank;
  uint views_word;  // where tables begin in slot 0
  uint lights_word;
  uint pairs_word;
  uint light_count;
  uint scale_word;    // channel c of component k (0 is the mean) of view v has scale
                      // (v (rank + 1) + k) all_channels + c
  uint weight_scale;  // number of the first scale of the weights
  uint weight_word;   // alpha: rank elements a pair
  uint texel_precision;
  uint table_precision;
  uint rows_per_slot;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
PcarfParams pcarf_params(uint handle) {
  PcarfParams p = PcarfParams(BTFC_P16(0u), BTFC_P(16u), BTFC_P(17u));
  p.channels = btfc_bound(p.channels, 4u);
  p.rank = btfc_bound(p.rank, 255u);
  p.rows_per_slot = btfc_least(p.rows_per_slot, 1u);
  return p;
}
#endif

// alpha_vk under three lights; k from 0.
BTFC_FN float pcarf_weight(BTFC_WORDS words, BTFC_IN(PcarfParams) p, uint view, BTFC_IN(BtfcCorners) light,
                           uint k) {
  float sum = 0.0f;
  for (int j = 0; j < 3; ++j) {
    if (light.weight[j] == 0.0f) continue;
    uint pair = btfc_pair(words, p.pairs_word, p.light_count, view, light.index[j]);
    sum += light.weight[j] * btfc_element(words, 0u, p.weight_word, p.table_precision, pair * p.rank + k);
  }
  vec2 scale = btfc_scale(words, p.scale_word, p.weight_scale + k);
  return scale.x + scale.y * sum;
}

BTFC_FN vec4 pcarf_eval(BTFC_WORDS words, BTFC_IN(PcarfParams) p, BTFC_IN(BtfcQuery) query) {
  uint texel = btfc_texel(query.texel, p.width, p.height, p.wrap_u, p.wrap_v);
  uint row_elements = (p.rank + 1u) * p.all_channels;
  BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  vec4 value = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 3; ++i) {
    if (view.weight[i] == 0.0f) continue;
    uint row_number = view.index[i] * p.width * p.height + texel;
    uint slot = 1u + row_number / p.rows_per_slot;
    uint row = row_number % p.rows_per_slot * row_elements + p.first_channel;
    uint scales = view.index[i] * row_elements + p.first_channel;
    for (uint k = 0u; k <= p.rank; ++k) {
      float weight = view.weight[i];
      if (k > 0u) weight *= pcarf_weight(words, p, view.index[i], light, k - 1u);
      for (uint c = 0u; c < p.channels; ++c) {
        vec2 scale = btfc_scale(words, p.scale_word, scales + k * p.all_channels + c);
        float element = btfc_element(words, slot, 0u, p.texel_precision, row + k * p.all_channels + c);
        value[int(c)] += weight * (scale.x + scale.y * element);
      }
    }
  }
  return value;
}

BTFC_END
#endif
