// Model gm: a Gaussian mixture over texel and directions, evaluated as its conditional expectation (Filip,
// Grim, Haindl, "A probabilistic approach to rough texture compression and rendering", eqs 8-11;
// spec/models/gm.md section 4).
//
// The gate of component m at input s = (x, y, view a, view b, light a, light b) is eq. 9 in base 2:
//   l_m(s) = height_m - sum over n of scale_mn (s_n - mu_mn)^2,   scale = log2(e) / (2 sigma^2)
//   W_m = 2^l_m / sum over j of 2^l_j,   value = mean BRDF + sum over m of W_m output_m.
// mu_x and mu_y drift with the directions (parallax, shadows) by two shears, h_v and h_l.
#ifndef BTFC_GM_H
#define BTFC_GM_H
#include "../btfc_array.h"
#include "../btfc_directions.h"
#include "../btfc_light.h"
#include "../btfc_math.h"
#include "../btfc_query.h"

BTFC_BEGIN

const uint GM_COMPONENTS = 1u;  // the word slot of GM_STRIDE floats a component; slot 0 has the mean BRDF

// Floats of a component: mu (6), scale (6), height, outputs (4), h_v, h_l, one left free.
const uint GM_STRIDE = 20u;
const uint GM_SCALE = 6u;
const uint GM_HEIGHT = 12u;
const uint GM_OUTPUT = 13u;
const uint GM_SHEAR = 17u;

const uint GM_MOST_GATES = 32u;

// Slopes of grazing directions are those of this z: tan 78.5 degrees is the steepest.
const float GM_LEAST_Z = 0.2f;
// Below any gate of a valid file: what has it never counts.
const float GM_NEVER = -1.0e30f;
// 1 / sigma^2 = 2 ln 2 scale.
const float GM_TWO_LN2 = 1.38629436f;

// Forms of the mean BRDF, and what was done to values before the fit (spec/registry.md).
const uint GM_MEAN_F32 = 0u;
const uint GM_MEAN_CODED = 2u;
const uint GM_TRANSFORM_LOG = 2u;
const uint GM_ONION_PRINTED = 1u;

// One map's parameters. Slot 0: direction tables, mean BRDF; slot 1: components.
struct GmParams {
  uint width;  // texels
  uint height;
  uint wrap_u;  // 1: distances in x, y are those on the torus
  uint wrap_v;
  uint channels;       // of the map
  uint first_channel;  // among those of all maps
  uint all_channels;
  uint components;
  uint gates;       // K: the K highest gates count; 0: all
  uint views_word;  // where tables begin in slot 0
  uint lights_word;
  uint pairs_word;
  uint view_count;
  uint light_count;
  uint mean_form;
  uint mean_word;  // the table's elements; or steps, then view codes, then light codes
  uint mean_rank;  // of GM_MEAN_CODED
  uint transform;
  uint onion;  // 1: the printed angles, whose second is never below 0
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
GmParams gm_params(uint handle) {
  GmParams p = GmParams(BTFC_P16(0u), BTFC_P(16u), BTFC_P(17u), BTFC_P(18u));
  p.channels = btfc_bound(p.channels, 4u);
  p.components = btfc_bound(p.components, 65536u);
  p.mean_rank = btfc_bound(p.mean_rank, 255u);
  return p;
}
#endif

// Onion-slice angles, signed: asin(x), atan2(y, z). The printed arccos(cos theta / cos xi) is the latter's
// absolute value, which folds mirror directions together. asin by way of atan2: exact near the poles.
BTFC_FN vec2 gm_onion(BTFC_IN(vec3) w) {
  return vec2(btfc_atan2(w.x, btfc_sqrt(w.y * w.y + w.z * w.z)), btfc_atan2(w.y, w.z));
}

// How far, in texels, what lies one texel above the surface seems to move: texel rows run down, y up.
BTFC_FN vec2 gm_slope(BTFC_IN(vec3) w) {
  float z = w.z < GM_LEAST_Z ? GM_LEAST_Z : w.z;
  return vec2(w.x / z, -w.y / z);
}

// A query's directions as the mixture sees them.
struct GmDirections {
  vec2 view;
  vec2 light;
  vec2 view_slope;
  vec2 light_slope;
};

BTFC_FN GmDirections gm_directions(BTFC_IN(vec3) view, BTFC_IN(vec3) light, uint onion) {
  GmDirections d;
  d.view = gm_onion(view);
  d.light = gm_onion(light);
  if (onion == GM_ONION_PRINTED) {
    if (d.view.y < 0.0f) d.view.y = -d.view.y;
    if (d.light.y < 0.0f) d.light.y = -d.light.y;
  }
  d.view_slope = gm_slope(view);
  d.light_slope = gm_slope(light);
  return d;
}

// d - period * round(d / period), ties upwards: the short way round the torus.
BTFC_FN float gm_short_way(float d, float period) {
  BTFC_PRECISE float turns = floor(d / period + 0.5f);
  return d - period * turns;
}

BTFC_FN float gm_number(BTFC_WORDS words, uint m, uint i) {
  return uintBitsToFloat(btfc_word(words, GM_COMPONENTS, m * GM_STRIDE + i));
}

// Scales of x and y once a footprint of that variance (texels^2) is added to the component's own, and what
// its peak loses, as the convolution of two Gaussians does; powers of two.
struct GmWider {
  float x;
  float y;
  float peak;  // <= 0
};

BTFC_FN GmWider gm_wider(float scale_x, float scale_y, float variance) {
  BTFC_PRECISE float wider_x = 1.0f + GM_TWO_LN2 * variance * scale_x;
  BTFC_PRECISE float wider_y = 1.0f + GM_TWO_LN2 * variance * scale_y;
  GmWider wider;
  wider.x = scale_x / wider_x;
  wider.y = scale_y / wider_y;
  wider.peak = -0.5f * btfc_log2(wider_x) - 0.5f * btfc_log2(wider_y);
  return wider;
}

// The variance of a box of so many texels beyond that of a texel, of which values are means already.
BTFC_FN float gm_variance(float footprint) {
  if (!(footprint > 1.0f)) return 0.0f;
  float f = footprint < BTFC_MOST_FOOTPRINT ? footprint : BTFC_MOST_FOOTPRINT;
  return (f * f - 1.0f) / 12.0f;
}

// What of l_m the four angles take.
BTFC_FN float gm_angular(BTFC_WORDS words, uint m, BTFC_IN(GmDirections) d) {
  float d0 = d.view.x - gm_number(words, m, 2u);
  float d1 = d.view.y - gm_number(words, m, 3u);
  float d2 = d.light.x - gm_number(words, m, 4u);
  float d3 = d.light.y - gm_number(words, m, 5u);
  BTFC_PRECISE float distance = gm_number(words, m, GM_SCALE + 2u) * d0 * d0;
  distance = distance + gm_number(words, m, GM_SCALE + 3u) * d1 * d1;
  distance = distance + gm_number(words, m, GM_SCALE + 4u) * d2 * d2;
  distance = distance + gm_number(words, m, GM_SCALE + 5u) * d3 * d3;
  return distance;
}

// The same of component m; as it is where there is no footprint.
BTFC_FN GmWider gm_spread(BTFC_WORDS words, uint m, float variance) {
  GmWider spread;
  spread.x = gm_number(words, m, GM_SCALE);
  spread.y = gm_number(words, m, GM_SCALE + 1u);
  spread.peak = 0.0f;
  if (variance > 0.0f) spread = gm_wider(spread.x, spread.y, variance);
  return spread;
}

// l_m at (x, y), texels, with the spatial spread that the footprint leaves it.
BTFC_FN float gm_gate(BTFC_WORDS words, BTFC_IN(GmParams) p, uint m, float x, float y,
                      BTFC_IN(GmDirections) d, BTFC_IN(GmWider) spread) {
  float hv = gm_number(words, m, GM_SHEAR);
  float hl = gm_number(words, m, GM_SHEAR + 1u);
  BTFC_PRECISE float dx = x - gm_number(words, m, 0u) - hv * d.view_slope.x - hl * d.light_slope.x;
  BTFC_PRECISE float dy = y - gm_number(words, m, 1u) - hv * d.view_slope.y - hl * d.light_slope.y;
  if (p.wrap_u == 1u) dx = gm_short_way(dx, float(p.width));
  if (p.wrap_v == 1u) dy = gm_short_way(dy, float(p.height));
  float peak = gm_number(words, m, GM_HEIGHT) + spread.peak;
  BTFC_PRECISE float distance = spread.x * dx * dx + spread.y * dy * dy;
  return peak - distance - gm_angular(words, m, d);
}

BTFC_FN vec4 gm_output(BTFC_WORDS words, BTFC_IN(GmParams) p, uint m) {
  vec4 output_m = vec4(0.0f);
  for (uint c = 0u; c < p.channels; c++)
    output_m[int(c)] = gm_number(words, m, GM_OUTPUT + p.first_channel + c);
  return output_m;
}

// All that the texels of a query's directions and footprint share.
struct GmState {
  GmDirections directions;
  vec4 mean;       // the mean BRDF, before the transform is undone
  vec4 far_limit;  // the mixture's own value where the footprint covers everything: 0 for one texel
  float variance;  // of the footprint
};

// What component m adds under a footprint. The more of its peak is gone, the more of it is the mixture's far
// limit, which is taken off: what is left far away is the mean BRDF.
BTFC_FN vec4 gm_output_seen(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(GmState) s, uint m,
                            BTFC_IN(GmWider) spread) {
  vec4 output_m = gm_output(words, p, m);
  if (s.variance > 0.0f) output_m = output_m - (1.0f - btfc_exp2(spread.peak)) * s.far_limit;
  return output_m;
}

// A running sum of weighted outputs, all seen from the largest gate so far, so that no query underflows.
struct GmSum {
  vec4 outputs;
  float weights;
  float largest;
};

BTFC_FN GmSum gm_no_sum() {
  GmSum sum;
  sum.outputs = vec4(0.0f);
  sum.weights = 0.0f;
  sum.largest = GM_NEVER;
  return sum;
}

BTFC_FN GmSum gm_add(BTFC_IN(GmSum) before, float gate, BTFC_IN(vec4) output_m) {
  GmSum sum = before;
  if (gate > sum.largest) {
    float shrink = btfc_exp2(sum.largest - gate);
    sum.outputs = sum.outputs * shrink;
    sum.weights = sum.weights * shrink;
    sum.largest = gate;
  }
  float w = btfc_exp2(gate - sum.largest);
  sum.outputs = sum.outputs + w * output_m;
  sum.weights = sum.weights + w;
  return sum;
}

BTFC_FN vec4 gm_expectation(BTFC_IN(GmSum) sum) {
  return sum.weights > 0.0f ? sum.outputs / sum.weights : vec4(0.0f);
}

// The limit of eq. 11's sum for an infinite footprint: every place counts alike.
BTFC_FN vec4 gm_far_limit(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(GmDirections) d) {
  GmSum sum = gm_no_sum();
  for (uint m = 0u; m < p.components; m++) {
    // A peak over sigma_x sigma_y is what its integral over x and y is proportional to.
    float area = -0.5f * btfc_log2(gm_number(words, m, GM_SCALE)) -
                 0.5f * btfc_log2(gm_number(words, m, GM_SCALE + 1u));
    float gate = gm_number(words, m, GM_HEIGHT) + area - gm_angular(words, m, d);
    sum = gm_add(sum, gate, gm_output(words, p, m));
  }
  return gm_expectation(sum);
}

// The sum of eq. 11 without the mean BRDF, over all components.
BTFC_FN vec4 gm_of_all(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(GmState) s, float x, float y) {
  GmSum sum = gm_no_sum();
  for (uint m = 0u; m < p.components; m++) {
    GmWider spread = gm_spread(words, m, s.variance);
    float gate = gm_gate(words, p, m, x, y, s.directions, spread);
    sum = gm_add(sum, gate, gm_output_seen(words, p, s, m, spread));
  }
  return gm_expectation(sum);
}

// The same over the K highest gates; of equal ones the first.
BTFC_FN vec4 gm_of_best(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(GmState) s, float x, float y) {
  float best[GM_MOST_GATES];  // falling
  uint number[GM_MOST_GATES];
  uint kept = 0u;
  uint most = min(p.gates, GM_MOST_GATES);
  for (uint m = 0u; m < p.components; m++) {
    float gate = gm_gate(words, p, m, x, y, s.directions, gm_spread(words, m, s.variance));
    if (kept == most && gate <= best[kept - 1u]) continue;
    uint at = kept < most ? kept : kept - 1u;
    while (at > 0u && best[at - 1u] < gate) {
      best[at] = best[at - 1u];
      number[at] = number[at - 1u];
      at = at - 1u;
    }
    best[at] = gate;
    number[at] = m;
    if (kept < most) kept = kept + 1u;
  }
  GmSum sum = gm_no_sum();
  for (uint i = 0u; i < kept; i++) {
    GmWider spread = gm_spread(words, number[i], s.variance);
    sum = gm_add(sum, best[i], gm_output_seen(words, p, s, number[i], spread));
  }
  return gm_expectation(sum);
}

// Element of a row of signed codes, held as code + 128.
BTFC_FN float gm_signed_code(BTFC_WORDS words, uint word, uint index) {
  return btfc_element(words, 0u, word, BTFC_U8, index) - 128.0f;
}

// The mean BRDF as factors: sum over k of step_k (sum of view codes) (sum of light codes).
BTFC_FN vec4 gm_coded_mean(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(BtfcCorners) view,
                           BTFC_IN(BtfcCorners) light) {
  uint view_word = p.mean_word + p.mean_rank;
  uint light_word = view_word + (p.mean_rank * p.view_count + 3u) / 4u;
  vec4 value = vec4(0.0f);
  for (uint k = 0u; k < p.mean_rank; k++) {
    float step_k = uintBitsToFloat(btfc_word(words, 0u, p.mean_word + k));
    float of_view = 0.0f;
    for (int i = 0; i < 3; i++)
      of_view += view.weight[i] * gm_signed_code(words, view_word, k * p.view_count + view.index[i]);
    for (uint c = 0u; c < p.channels; c++) {
      float of_light = 0.0f;
      for (int j = 0; j < 3; j++) {
        uint row = (k * p.light_count + light.index[j]) * p.all_channels + p.first_channel + c;
        of_light += light.weight[j] * gm_signed_code(words, light_word, row);
      }
      value[int(c)] += step_k * of_view * of_light;
    }
  }
  return value;
}

// The mean BRDF as a table: the nine pairs around the query's.
BTFC_FN vec4 gm_table_mean(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(BtfcCorners) view,
                           BTFC_IN(BtfcCorners) light) {
  uint precision_m = p.mean_form == GM_MEAN_F32 ? BTFC_F32 : BTFC_U8;
  float step_m = p.mean_form == GM_MEAN_F32 ? 1.0f : 0.00392156886f;  // binary32 nearest to 1/255
  vec4 value = vec4(0.0f);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      float weight = view.weight[i] * light.weight[j];
      if (weight == 0.0f) continue;
      uint pair = btfc_pair(words, p.pairs_word, p.light_count, view.index[i], light.index[j]);
      for (uint c = 0u; c < p.channels; c++) {
        uint element = pair * p.all_channels + p.first_channel + c;
        value[int(c)] += weight * step_m * btfc_element(words, 0u, p.mean_word, precision_m, element);
      }
    }
  }
  return value;
}

BTFC_FN GmState gm_begin(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(BtfcQuery) query) {
  GmState s;
  s.directions = gm_directions(btfc_upper_unit(query.view), btfc_upper_unit(query.light), p.onion);
  BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  if (p.mean_form == GM_MEAN_CODED) {
    s.mean = gm_coded_mean(words, p, view, light);
  } else {
    s.mean = gm_table_mean(words, p, view, light);
  }
  s.variance = gm_variance(query.footprint);
  s.far_limit = vec4(0.0f);
  if (s.variance > 0.0f) s.far_limit = gm_far_limit(words, p, s.directions);
  return s;
}

// exp(v) - 1 of each channel where values are logarithms.
BTFC_FN vec4 gm_undo_transform(BTFC_IN(vec4) value, uint transform) {
  if (transform != GM_TRANSFORM_LOG) return value;
  vec4 linear = vec4(0.0f);
  for (int c = 0; c < 4; c++) linear[c] = btfc_exp2(1.44269504f * value[c]) - 1.0f;
  return linear;
}

// At a place between texels, too: (x, y) in texels from the top left corner.
BTFC_FN vec4 gm_eval_at(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(BtfcQuery) query, float x, float y) {
  GmState s = gm_begin(words, p, query);
  vec4 sum = vec4(0.0f);
  if (p.gates == 0u) {
    sum = gm_of_all(words, p, s, x, y);
  } else {
    sum = gm_of_best(words, p, s, x, y);
  }
  return gm_undo_transform(s.mean + sum, p.transform);
}

BTFC_FN vec4 gm_eval(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(BtfcQuery) query) {
  return gm_eval_at(words, p, query, float(btfc_wrap(query.texel.x, p.width, p.wrap_u)) + 0.5f,
                    float(btfc_wrap(query.texel.y, p.height, p.wrap_v)) + 0.5f);
}

BTFC_END
#endif
