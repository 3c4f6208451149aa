// Model gm: a Gaussian mixture over texel and directions, evaluated as its conditional expectation (Filip,
// Grim, Haindl, "A probabilistic approach to rough texture compression and rendering", eqs 8-11).
//
// The gate of component m at input s = (x, y, view a, view b, light a, light b) is eq. 9 in base 2:
//   l_m(s) = height_m - sum over n of scale_mn (s_n - mu_mn)^2,   scale = log2(e) / (2 sigma^2)
//   W_m = 2^l_m / sum over j of 2^l_j,   value = mean BRDF + sum over m of W_m output_m.
// mu_x and mu_y drift with the directions (parallax, shadows) by two shears, h_v and h_l.
#ifndef BTFC_GM_H
#define BTFC_GM_H
#include "../btfc_language.h"
#include "../btfc_math.h"

BTFC_BEGIN

// Word slots.
const uint GM_COMPONENTS = 0u;  // GM_STRIDE floats a component
const uint GM_LISTS = 1u;       // first word and count of each cell's list, then the lists

// Floats of a component: mu (6), scale (6), height, outputs (4), h_v, h_l, one left free.
const uint GM_STRIDE = 20u;
const uint GM_SCALE = 6u;
const uint GM_HEIGHT = 12u;
const uint GM_OUTPUT = 13u;
const uint GM_SHEAR = 17u;

const uint GM_MOST_GATES = 32u;

// Slopes of grazing directions are those of this z: tan 78.5 degrees is the steepest.
const float GM_LEAST_Z = 0.2f;
// Far below any height: what has it never counts.
const float GM_NEVER = -1.0e30f;

struct GmParams {
  uint components;
  uint channels;
  uint gates;   // K: the K highest gates count; 0: all
  float width;  // texels of the tile
  float height;
  uint wraps;    // 1: distances in x, y are those on the torus
  uint cells_x;  // lists: cells of cell_size texels; 0: no lists, every component is looked at
  uint cells_y;
  float cell_size;
};

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

BTFC_FN GmDirections gm_directions(BTFC_IN(vec3) view, BTFC_IN(vec3) light) {
  GmDirections d;
  d.view = gm_onion(view);
  d.light = gm_onion(light);
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

// l_m at (x, y), texels. variance: that of the pixel's footprint, texels^2; it widens the spatial spreads and
// lowers the peak as the convolution of two Gaussians does.
BTFC_FN float gm_gate(BTFC_WORDS words, BTFC_IN(GmParams) p, uint m, float x, float y,
                      BTFC_IN(GmDirections) d, float variance) {
  float hv = gm_number(words, m, GM_SHEAR);
  float hl = gm_number(words, m, GM_SHEAR + 1u);
  BTFC_PRECISE float dx = x - gm_number(words, m, 0u) - hv * d.view_slope.x - hl * d.light_slope.x;
  BTFC_PRECISE float dy = y - gm_number(words, m, 1u) - hv * d.view_slope.y - hl * d.light_slope.y;
  if (p.wraps == 1u) {
    dx = gm_short_way(dx, p.width);
    dy = gm_short_way(dy, p.height);
  }
  float sx = gm_number(words, m, GM_SCALE);
  float sy = gm_number(words, m, GM_SCALE + 1u);
  float peak = gm_number(words, m, GM_HEIGHT);
  if (variance > 0.0f) {
    // 1 + variance / sigma^2, with 1 / sigma^2 = 2 ln 2 scale.
    BTFC_PRECISE float wider_x = 1.0f + 1.38629436f * variance * sx;
    BTFC_PRECISE float wider_y = 1.0f + 1.38629436f * variance * sy;
    sx = sx / wider_x;
    sy = sy / wider_y;
    peak = peak - 0.5f * btfc_log2(wider_x) - 0.5f * btfc_log2(wider_y);
  }
  float d0 = d.view.x - gm_number(words, m, 2u);
  float d1 = d.view.y - gm_number(words, m, 3u);
  float d2 = d.light.x - gm_number(words, m, 4u);
  float d3 = d.light.y - gm_number(words, m, 5u);
  BTFC_PRECISE float distance = sx * dx * dx + sy * dy * dy;
  distance = distance + gm_number(words, m, GM_SCALE + 2u) * d0 * d0;
  distance = distance + gm_number(words, m, GM_SCALE + 3u) * d1 * d1;
  distance = distance + gm_number(words, m, GM_SCALE + 4u) * d2 * d2;
  distance = distance + gm_number(words, m, GM_SCALE + 5u) * d3 * d3;
  return peak - distance;
}

// A cell's list inside slot GM_LISTS: (first word, count).
BTFC_FN uvec2 gm_list(BTFC_WORDS words, BTFC_IN(GmParams) p, float x, float y) {
  if (p.cells_x == 0u) return uvec2(0u, p.components);
  uint i = min(uint(x / p.cell_size), p.cells_x - 1u);
  uint j = min(uint(y / p.cell_size), p.cells_y - 1u);
  uint cell = 2u * (j * p.cells_x + i);
  return uvec2(btfc_word(words, GM_LISTS, cell), btfc_word(words, GM_LISTS, cell + 1u));
}

BTFC_FN uint gm_listed(BTFC_WORDS words, BTFC_IN(GmParams) p, BTFC_IN(uvec2) list, uint i) {
  return p.cells_x == 0u ? i : btfc_word(words, GM_LISTS, list.x + i);
}

BTFC_FN vec4 gm_output(BTFC_WORDS words, uint m) {
  return vec4(gm_number(words, m, GM_OUTPUT), gm_number(words, m, GM_OUTPUT + 1u),
              gm_number(words, m, GM_OUTPUT + 2u), gm_number(words, m, GM_OUTPUT + 3u));
}

// The sum of eq. 11 without the mean BRDF, over all components of the list. The largest gate is taken off
// before 2^x, so that no query underflows.
BTFC_FN vec4 gm_expectation_all(BTFC_WORDS words, BTFC_IN(GmParams) p, float x, float y,
                                BTFC_IN(GmDirections) d, float variance) {
  uvec2 list = gm_list(words, p, x, y);
  float largest = GM_NEVER;
  vec4 sum = vec4(0.0f);
  float weights = 0.0f;
  for (uint i = 0u; i < list.y; i++) {
    uint m = gm_listed(words, p, list, i);
    float gate = gm_gate(words, p, m, x, y, d, variance);
    if (gate > largest) {  // the sums so far, seen from the new peak
      float shrink = largest == GM_NEVER ? 0.0f : btfc_exp2(largest - gate);
      sum = sum * shrink;
      weights = weights * shrink;
      largest = gate;
    }
    float w = btfc_exp2(gate - largest);
    sum = sum + w * gm_output(words, m);
    weights = weights + w;
  }
  return weights > 0.0f ? sum / weights : vec4(0.0f);
}

// The same over the K highest gates; of equal ones the first of the list.
BTFC_FN vec4 gm_expectation_best(BTFC_WORDS words, BTFC_IN(GmParams) p, float x, float y,
                                 BTFC_IN(GmDirections) d, float variance) {
  float best[GM_MOST_GATES];  // falling
  uint number[GM_MOST_GATES];
  uint kept = 0u;
  uint most = min(p.gates, GM_MOST_GATES);
  uvec2 list = gm_list(words, p, x, y);
  for (uint i = 0u; i < list.y; i++) {
    uint m = gm_listed(words, p, list, i);
    float gate = gm_gate(words, p, m, x, y, d, variance);
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
  vec4 sum = vec4(0.0f);
  float weights = 0.0f;
  for (uint i = 0u; i < kept; i++) {
    float w = btfc_exp2(best[i] - best[0]);
    sum = sum + w * gm_output(words, number[i]);
    weights = weights + w;
  }
  return weights > 0.0f ? sum / weights : vec4(0.0f);
}

BTFC_FN vec4 gm_expectation(BTFC_WORDS words, BTFC_IN(GmParams) p, float x, float y, BTFC_IN(GmDirections) d,
                            float variance) {
  if (p.gates == 0u) return gm_expectation_all(words, p, x, y, d, variance);
  return gm_expectation_best(words, p, x, y, d, variance);
}

BTFC_END
#endif
