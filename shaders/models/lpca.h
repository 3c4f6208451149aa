// Model lpca: BTF(r, i, v) = mu_m(i, v) + sum_k alpha_k(r) E_mk(i, v), m = the texel's cluster (survey, eq.
// 7; spec/models/lpca.md section 4).
#ifndef BTFC_LPCA_H
#define BTFC_LPCA_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_query.h"

BTFC_BEGIN

const uint LPCA_TEXELS = 1u;       // slot: alpha, rank elements a texel
const uint LPCA_REFLECTANCE = 2u;  // slots 2 and 3: row cluster * pairs + pair, mu then E_1 … E_rank, each of
                                   // all channels

// One map's parameters. Slot 0: direction tables, scales, cluster numbers.
struct LpcaParams {
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
  uint pair_count;
  uint scale_word;    // channel c of component k (0 is the mean) of cluster m has scale
                      // (m (rank + 1) + k) all_channels + c
  uint weight_scale;  // number of the first scale of alpha
  uint cluster_word;  // a cluster number a texel
  uint cluster_bits;  // 8 or 16
  uint texel_precision;
  uint table_precision;
  uint rows_per_slot;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
LpcaParams lpca_params(uint handle) {
  LpcaParams p = LpcaParams(BTFC_P16(0u), BTFC_P4(16u));
  p.channels = btfc_bound(p.channels, 4u);
  p.rank = btfc_bound(p.rank, 255u);
  p.rows_per_slot = btfc_least(p.rows_per_slot, 1u);
  return p;
}
#endif

BTFC_FN uint lpca_cluster(BTFC_WORDS words, BTFC_IN(LpcaParams) p, uint texel) {
  uint shift = p.cluster_bits == 8u ? 2u : 1u;  // log2 of the numbers a word
  uint word = btfc_word(words, 0u, p.cluster_word + (texel >> shift));
  uint mask = p.cluster_bits == 8u ? 0xffu : 0xffffu;
  return (word >> ((texel & ((1u << shift) - 1u)) * p.cluster_bits)) & mask;
}

// mu (k = 0) or E_k of a cluster under nine pairs of directions.
BTFC_FN vec4 lpca_reflectance(BTFC_WORDS words, BTFC_IN(LpcaParams) p, BTFC_IN(BtfcCorners) view,
                              BTFC_IN(BtfcCorners) light, uint cluster, uint k) {
  uint stride = (p.rank + 1u) * p.all_channels;
  vec4 sum = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float weight = view.weight[i] * light.weight[j];
      if (weight == 0.0f) continue;
      uint pair = btfc_pair(words, p.pairs_word, p.light_count, view.index[i], light.index[j]);
      uint row_number = cluster * p.pair_count + pair;
      uint slot = LPCA_REFLECTANCE + row_number / p.rows_per_slot;
      uint row = row_number % p.rows_per_slot * stride + k * p.all_channels + p.first_channel;
      for (uint c = 0u; c < p.channels; ++c)
        sum[int(c)] += weight * btfc_element(words, slot, 0u, p.table_precision, row + c);
    }
  }
  vec4 value = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (uint c = 0u; c < p.channels; ++c) {
    vec2 scale = btfc_scale(words, p.scale_word, cluster * stride + k * p.all_channels + p.first_channel + c);
    value[int(c)] = scale.x + scale.y * sum[int(c)];
  }
  return value;
}

BTFC_FN vec4 lpca_eval(BTFC_WORDS words, BTFC_IN(LpcaParams) p, BTFC_IN(BtfcQuery) query) {
  uint texel = btfc_texel(query.texel, p.width, p.height, p.wrap_u, p.wrap_v);
  uint cluster = lpca_cluster(words, p, texel);
  BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  vec4 value = lpca_reflectance(words, p, view, light, cluster, 0u);
  for (uint k = 0u; k < p.rank; ++k) {
    vec2 scale = btfc_scale(words, p.scale_word, p.weight_scale + k);
    float element = btfc_element(words, LPCA_TEXELS, 0u, p.texel_precision, texel * p.rank + k);
    float alpha = scale.x + scale.y * element;
    vec4 vector = lpca_reflectance(words, p, view, light, cluster, k + 1u);
    for (uint c = 0u; c < p.channels; ++c) value[int(c)] += alpha * vector[int(c)];
  }
  return value;
}

BTFC_END
#endif
