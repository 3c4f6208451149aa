// From a direction to the three nearest measured ones and their weights: one function for all models
// (spec/tables.md section 4).
#ifndef BTFC_DIRECTIONS_H
#define BTFC_DIRECTIONS_H
#include "btfc_language.h"

BTFC_BEGIN

// A table lies in slot 0: a header (points n, triangles, border sides, 0), 2 n coordinates as floats, room
// for 2 n triangles of 6 words (corners, neighbours opposite them), room for n border sides of 2 words, and a
// grid that says where the walk to a point begins.
const uint BTFC_TABLE_HEADER = 4u;
const uint BTFC_GRID_SIDE = 16u;
const uint BTFC_NONE = 0xffffffffu;

// Weights below this count as 0, so that a measured direction gives its own table entry and nothing else.
const float BTFC_LEAST_WEIGHT = 1.52587890625e-05f;  // 2^-16

struct BtfcCorners {
  uvec3 index;  // of the direction list; every index is valid, whatever its weight
  vec3 weight;  // >= 0, sum 1 up to rounding
};

// Stereographic projection: (x, y) / (|d| + z), with z not below 0, so within the unit disk. Any length;
// nothing at all, and what is no number, counts as the normal.
BTFC_FN vec2 btfc_project(BTFC_IN(vec3) direction) {
  float x = direction.x, y = direction.y, z = direction.z > 0.0f ? direction.z : 0.0f;
  float length = sqrt(x * x + y * y + z * z);
  float bottom = length + z;
  if (!(bottom > 1e-18f && bottom < 1e18f)) return vec2(0.0f, 0.0f);
  return vec2(x / bottom, y / bottom);
}

BTFC_FN vec2 btfc_table_point(BTFC_WORDS words, uint points, uint index) {
  return vec2(uintBitsToFloat(btfc_word(words, 0u, points + 2u * index)),
              uintBitsToFloat(btfc_word(words, 0u, points + 2u * index + 1u)));
}

// Twice the area of (a, b, p). Exactly the negative of that of (b, a, p), so that the two triangles at a side
// agree on which of them holds a point.
BTFC_FN float btfc_side(BTFC_IN(vec2) a, BTFC_IN(vec2) b, BTFC_IN(vec2) p) {
  BTFC_PRECISE float left = (a.x - p.x) * (b.y - p.y);
  BTFC_PRECISE float right = (a.y - p.y) * (b.x - p.x);
  BTFC_PRECISE float area = left - right;
  return area;
}

BTFC_FN BtfcCorners btfc_settle(BTFC_IN(uvec3) index, BTFC_IN(vec3) raw) {
  BtfcCorners c;
  c.index = index;
  vec3 w = vec3(raw.x > 0.0f ? raw.x : 0.0f, raw.y > 0.0f ? raw.y : 0.0f, raw.z > 0.0f ? raw.z : 0.0f);
  float sum = w.x + w.y + w.z;
  if (!(sum > 0.0f)) {
    c.weight = vec3(1.0f, 0.0f, 0.0f);
    return c;
  }
  float least = BTFC_LEAST_WEIGHT * sum;
  w = vec3(w.x < least ? 0.0f : w.x, w.y < least ? 0.0f : w.y, w.z < least ? 0.0f : w.z);
  sum = w.x + w.y + w.z;
  c.weight = vec3(w.x / sum, w.y / sum, w.z / sum);
  return c;
}

// The nearest point of the hull's border. Where the foot of p on a side lies s from the side's end, foot and
// end are as near but for s^2 / 2: less than rounding while s still shows in the weights. So a foot between
// the ends of its side is preferred to an end that is nearer by less than this.
const float BTFC_NEAR = 4.76837158203125e-07f;  // 2^-21

BTFC_FN BtfcCorners btfc_border_corners(BTFC_WORDS words, uint points, uint sides, uint count,
                                        BTFC_IN(vec2) p) {
  uvec3 index = uvec3(0u, 0u, 0u);
  float best = 3.0e38f;
  float at = 0.0f;
  for (uint i = 0u; i < count; ++i) {
    uint first = btfc_word(words, 0u, sides + 2u * i), second = btfc_word(words, 0u, sides + 2u * i + 1u);
    vec2 a = btfc_table_point(words, points, first), b = btfc_table_point(words, points, second);
    vec2 ab = b - a, ap = p - a;
    float length = ab.x * ab.x + ab.y * ab.y;
    float t = length > 0.0f ? (ap.x * ab.x + ap.y * ab.y) / length : 0.0f;
    bool between = t > 0.0f && t < 1.0f;
    t = t < 0.0f ? 0.0f : (t > 1.0f ? 1.0f : t);
    vec2 off = vec2(ap.x - t * ab.x, ap.y - t * ab.y);
    float distance = sqrt(off.x * off.x + off.y * off.y) - (between ? BTFC_NEAR : 0.0f);
    if (distance < best) {
      best = distance;
      at = t;
      index = uvec3(first, second, first);
    }
  }
  return btfc_settle(index, vec3(1.0f - at, at, 0.0f));
}

// table: first word of a table in slot 0.
BTFC_FN BtfcCorners btfc_corners(BTFC_WORDS words, uint table, BTFC_IN(vec3) direction) {
  vec2 p = btfc_project(direction);
  uint count = btfc_bound(btfc_word(words, 0u, table), 1024u);
  uint triangles = btfc_bound(btfc_word(words, 0u, table + 1u), 2048u);
  uint points = table + BTFC_TABLE_HEADER;
  uint corners = points + 2u * count;
  uint sides = corners + 12u * count;
  if (triangles > 0u) {
    float cells = 0.5f * float(BTFC_GRID_SIDE);
    uint column = min(uint((p.x + 1.0f) * cells), BTFC_GRID_SIDE - 1u);
    uint row = min(uint((p.y + 1.0f) * cells), BTFC_GRID_SIDE - 1u);
    uint t = btfc_word(words, 0u, sides + 2u * count + row * BTFC_GRID_SIDE + column);
    // Each step crosses the side that p lies furthest behind. Few steps; the bound is for rounding's sake.
    for (uint step = 0u; step < triangles + 8u; ++step) {
      uint at = corners + 6u * t;
      uvec3 index =
          uvec3(btfc_word(words, 0u, at), btfc_word(words, 0u, at + 1u), btfc_word(words, 0u, at + 2u));
      vec2 a = btfc_table_point(words, points, index.x), b = btfc_table_point(words, points, index.y),
           c = btfc_table_point(words, points, index.z);
      vec3 w = vec3(btfc_side(b, c, p), btfc_side(c, a, p), btfc_side(a, b, p));
      uint worst = w.x <= w.y ? (w.x <= w.z ? 0u : 2u) : (w.y <= w.z ? 1u : 2u);
      float least = worst == 0u ? w.x : (worst == 1u ? w.y : w.z);
      if (least >= 0.0f) return btfc_settle(index, w);
      uint next = btfc_word(words, 0u, at + 3u + worst);
      if (next == BTFC_NONE) break;
      t = next;
    }
  }
  uint border = btfc_bound(btfc_word(words, 0u, table + 2u), 2048u);
  return btfc_border_corners(words, points, sides, border, p);
}

// The number of the pair that stands for (view, light). pairs: first word of the pair table, or BTFC_NONE.
BTFC_FN uint btfc_pair(BTFC_WORDS words, uint pairs, uint light_count, uint view, uint light) {
  uint cell = view * light_count + light;
  return pairs == BTFC_NONE ? cell : btfc_word(words, 0u, pairs + cell);
}

BTFC_END
#endif
