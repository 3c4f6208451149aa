// Model pca: BTF(r, i, v) = mu(r) + sum_k alpha_k(i, v) E_k(r) (survey, eq. 6; spec/models/pca.md section 4).
#ifndef BTFC_PCA_H
#define BTFC_PCA_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_query.h"

BTFC_BEGIN

// One map's parameters. Slot 0: direction tables, scales, weights; slots 1 to 3: a row a texel.
struct PcaParams {
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
  uint scale_word;   // of rows: channel c of component k (0 is the mean) has scale k all_channels + c, then
                     // those of the weights
  uint weight_word;  // alpha: rank elements a pair
  uint texel_precision;
  uint table_precision;
  uint rows_per_slot;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
PcaParams pca_params(uint handle) {
  PcaParams p = PcaParams(BTFC_P16(0u), BTFC_P(16u));
  p.channels = btfc_bound(p.channels, 4u);
  p.rank = btfc_bound(p.rank, 255u);
  p.rows_per_slot = btfc_least(p.rows_per_slot, 1u);
  return p;
}
#endif

// alpha_k under nine pairs of directions; k from 0.
BTFC_FN float pca_weight(BTFC_WORDS words, BTFC_IN(PcaParams) p, BTFC_IN(BtfcCorners) view,
                         BTFC_IN(BtfcCorners) light, uint k) {
  float sum = 0.0f;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float weight = view.weight[i] * light.weight[j];
      if (weight == 0.0f) continue;
      uint pair = btfc_pair(words, p.pairs_word, p.light_count, view.index[i], light.index[j]);
      sum += weight * btfc_element(words, 0u, p.weight_word, p.table_precision, pair * p.rank + k);
    }
  }
  vec2 scale = btfc_scale(words, p.scale_word, (p.rank + 1u) * p.all_channels + k);
  return scale.x + scale.y * sum;
}

BTFC_FN vec4 pca_eval(BTFC_WORDS words, BTFC_IN(PcaParams) p, BTFC_IN(BtfcQuery) query) {
  uint texel = btfc_texel(query.texel, p.width, p.height, p.wrap_u, p.wrap_v);
  uint slot = 1u + texel / p.rows_per_slot;
  uint row = texel % p.rows_per_slot * (p.rank + 1u) * p.all_channels + p.first_channel;
  BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  vec4 value = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (uint k = 0u; k <= p.rank; ++k) {
    float weight = k == 0u ? 1.0f : pca_weight(words, p, view, light, k - 1u);
    for (uint c = 0u; c < p.channels; ++c) {
      vec2 scale = btfc_scale(words, p.scale_word, k * p.all_channels + p.first_channel + c);
      float element = btfc_element(words, slot, 0u, p.texel_precision, row + k * p.all_channels + c);
      value[int(c)] += weight * (scale.x + scale.y * element);
    }
  }
  return value;
}

BTFC_END
#endif
