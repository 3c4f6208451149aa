// Models car, gmrf and car3d, one family of random fields of an unbounded texture (spec/models/car.md):
// counter-based noise, the pyramid's collapse, marginal tables, blending of subspaces, the bump filter, and
// the direct form, which answers a single texel without any cache.
#ifndef BTFC_FIELD_H
#define BTFC_FIELD_H
#include "../btfc_directions.h"
#include "../btfc_language.h"
#include "../btfc_light.h"
#include "../btfc_query.h"

BTFC_BEGIN

const uint FIELD_CAR = 0u;    // scalar causal recursions, one a factor
const uint FIELD_GMRF = 1u;   // tori made by a Fourier transform
const uint FIELD_CAR3D = 2u;  // one causal recursion of all channels

// Options of a query's relief.
const uint FIELD_NO_RELIEF = 1u;
const uint FIELD_SHADOW = 2u;
const uint FIELD_PARALLAX = 4u;

const uint FIELD_MOST_FACTORS = 16u;
const float FIELD_TABLE_END = 3.0f;  // tables span -3 … 3 standard deviations
const float FIELD_MOST_GAIN = 2.0f;

// Words of a level's record: its margin (gmrf: its torus' side), its first word in slot 1, the words of one
// response or torus there, and where in slot 0 its neighbourhoods and numbers lie.
const uint FIELD_LEVEL_WORDS = 4u;

struct FieldParams {
  uint width, height;            // of the analysed tile
  uint channels, first_channel;  // of the map
  uint all_channels;             // d, of all maps; as many factors
  uint clusters, levels, kind;   // levels: 0 is the finest
  uint views, lights, pairs;     // words of the direction tables
  uint light_count;
  uint index_word, index_bits;  // of the subspace index, bits a pair
  uint subspace_word, knots;    // records of subspaces, knots of a marginal table
  uint range_word, range_size;  // strength, then heights in texels; width | height << 16, 0: none
  uint level_word;              // records of levels
  uint seed, period;            // period in texels, 0: none but 2^32
  uint options, least_level;    // levels finer than least_level are not loaded
  // The window of texels, of level 0, whose collapsed levels lie in slot 2; a width of 0: none do. With a
  // period it is the whole of it.
  uint atlas_x, atlas_y, atlas_width, atlas_height;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
FieldParams field_params(uint handle) {
  FieldParams p =
      FieldParams(BTFC_P16(0u), BTFC_P4(16u), BTFC_P4(20u), BTFC_P(24u), BTFC_P(25u), BTFC_P(26u));
  p.channels = btfc_bound(p.channels, 4u);
  p.all_channels = btfc_least(btfc_bound(p.all_channels, FIELD_MOST_FACTORS), 1u);
  p.first_channel = btfc_bound(p.first_channel, p.all_channels - 1u);
  p.levels = btfc_least(btfc_bound(p.levels, 8u), 1u);
  p.knots = btfc_bound(p.knots, 64u);
  p.index_bits = btfc_bound(p.index_bits, 15u);
  return p;
}
#endif

// ---- noise

// M. Jarzynski, M. Olano, Hash functions for GPU rendering, JCGT 9(3), 2020: pcg3d.
BTFC_FN uvec3 field_hash(uint x, uint y, uint z) {
  x = x * 1664525u + 1013904223u;
  y = y * 1664525u + 1013904223u;
  z = z * 1664525u + 1013904223u;
  x += y * z;
  y += z * x;
  z += x * y;
  x ^= x >> 16u;
  y ^= y >> 16u;
  z ^= z >> 16u;
  x += y * z;
  y += z * x;
  z += x * y;
  return uvec3(x, y, z);
}

BTFC_FN uint field_bits(uint v) {
  v = v - ((v >> 1u) & 0x55555555u);
  v = (v & 0x33333333u) + ((v >> 2u) & 0x33333333u);
  v = (v + (v >> 4u)) & 0x0f0f0f0fu;
  return (v * 0x01010101u) >> 24u;
}

BTFC_FN uint field_stream(uint seed, uint level, uint factor) {
  return seed ^ (level * 0x9e3779b9u + factor * 0x85ebca6bu);
}

// A binomial number of 32 trials, smoothed by a triangle of two 16-bit numbers, less its mean: variance
// 2^32 (8 + 1/6) - 1/6, at most 1114111 in size. The hash's lowest bits repeat along the lattice; ones are
// counted after its higher bits came over them.
BTFC_FN int field_noise_integer(uint x, uint y, uint stream) {
  uvec3 h = field_hash(x, y, stream);
  uint mixed = (h.x ^ (h.x >> 16u)) * 0x85ebca6bu;
  return int((field_bits(mixed) << 16u) + (h.y >> 16u) + (h.y & 0xffffu)) - 1114111;
}

const float FIELD_NOISE_UNIT = 5.33944733e-06f;  // 1 / (65536 sqrt(49 / 6))

// ---- coordinates: texels of level l lie on a torus of 2^(32 - l), or of period / 2^l

BTFC_FN uint field_place(uint at, uint level, uint period) {
  if (period != 0u) return at % (period >> level);
  return at & (0xffffffffu >> level);
}

// A query's texel coordinate, in texels of `level`, as a place.
BTFC_FN uint field_origin(int at, uint level, uint period) {
  if (period == 0u) return uint(at) & (0xffffffffu >> level);
  return btfc_wrap(at, period >> level, 1u);
}

// What expanding by 2 makes of four weights at first … first + 3: up to four coarser ones. Even texels 2i
// take (1, 6, 1) / 8 of i-1, i, i+1, odd ones (1, 1) / 2 of i, i+1.
struct FieldWeights {
  uint first;
  float weight[4];
};

BTFC_FN void field_coarser(uint level, uint period, BTFC_INOUT(FieldWeights) w) {
  uint first = w.first;
  uint coarse = first % 2u == 0u ? first / 2u - 1u : first / 2u;
  float to[4];
  for (uint i = 0u; i < 4u; ++i) to[i] = 0.0f;
  for (uint i = 0u; i < 4u; ++i) {
    // Where texel first + i lies, counted from the coarse texel `coarse`.
    uint at = first % 2u == 0u ? i + 2u : i + 1u;
    uint half_at = at / 2u;
    if (at % 2u == 0u) {
      to[half_at - 1u] += 0.125f * w.weight[i];
      to[half_at] += 0.75f * w.weight[i];
      to[half_at + 1u] += 0.125f * w.weight[i];
    } else {
      to[half_at] += 0.5f * w.weight[i];
      to[half_at + 1u] += 0.5f * w.weight[i];
    }
  }
  // An odd first texel leaves to[0] empty where its weights begin at the coarse texel itself.
  w.first = field_place(coarse + (period == 0u ? 0u : period >> (level + 1u)), level + 1u, period);
  for (uint i = 0u; i < 4u; ++i) w.weight[i] = to[i];
}

// ---- levels and their responses

BTFC_FN uint field_level(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint level, uint what) {
  return btfc_word(words, 0u, p.level_word + FIELD_LEVEL_WORDS * level + what);
}

// The value of one level's field at one texel: the noise under the truncated impulse response, rows from the
// top, columns from the left (car: spec section 5.3). Of gmrf: a torus' texel.
BTFC_FN float field_band(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint subspace, uint factor, uint level,
                         uint x, uint y) {
  uint first = field_level(words, p, level, 1u), stride = field_level(words, p, level, 2u);
  if (p.kind == FIELD_GMRF) {
    uint side = field_level(words, p, level, 0u);
    uint at = (y % side) * side + x % side;
    return uintBitsToFloat(btfc_word(words, 1u, first + (subspace * p.all_channels + factor) * stride + at));
  }
  int margin = int(btfc_bound(field_level(words, p, level, 0u), 255u));
  uint begin = p.kind == FIELD_CAR3D ? 0u : factor,
       end = p.kind == FIELD_CAR3D ? p.all_channels : factor + 1u;
  float sum = 0.0f;
  for (uint g = begin; g < end; ++g) {
    uint row = p.kind == FIELD_CAR3D ? (subspace * p.all_channels + factor) * p.all_channels + g
                                     : subspace * p.all_channels + factor;
    uint stream = field_stream(p.seed, level, g);
    uint at = first + row * stride;
    uint whole = p.period == 0u ? 0u : p.period >> level;
    for (int dy = 0; dy <= margin; ++dy) {
      for (int dx = -margin; dx <= margin; ++dx) {
        float h = uintBitsToFloat(btfc_word(words, 1u, at));
        ++at;
        // Distances may exceed a short period.
        uint back_x = whole == 0u ? x - uint(dx) : x + whole - btfc_wrap(dx, whole, 1u);
        uint back_y = whole == 0u ? y - uint(dy) : y + whole - btfc_wrap(dy, whole, 1u);
        int e = field_noise_integer(field_place(back_x, level, p.period),
                                    field_place(back_y, level, p.period), stream);
        sum += h * (float(e) * FIELD_NOISE_UNIT);
      }
    }
  }
  return sum;
}

// ---- a query's place and level

struct FieldAt {
  uint x, y, level, smoothest;  // texel of `level`; levels finer than smoothest do not count
};

BTFC_FN FieldAt field_at(BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query) {
  FieldAt at;
  at.level = min(query.level, p.levels - 1u);
  uint wide = 0u;
  float footprint = query.footprint;
  while (wide + 1u < p.levels && footprint >= 2.0f) {
    footprint = 0.5f * footprint;
    wide = wide + 1u;
  }
  at.smoothest = max(max(at.level, p.least_level), wide);
  at.x = field_origin(query.texel.x, at.level, p.period);
  at.y = field_origin(query.texel.y, at.level, p.period);
  return at;
}

// ---- the prepared atlas: what the pyramid collapses to, level by level over a window, in slot 2

// How many texels of every level lie around the window. From two texels beyond it expanding reaches no
// farther than two texels of the coarser level beyond it.
const uint FIELD_ATLAS_APRON = 2u;

// A level's part: the place of its first texel, its size, and its first word. It holds a plane a subspace and
// factor, rows from the top.
struct FieldAtlasLevel {
  uint x, y, width, height, first;
};

// First place and count of texels along an axis.
BTFC_FN uvec2 field_atlas_axis(uint at, uint size, uint level, uint period) {
  if (period != 0u) return uvec2(0u, period >> level);
  uint inner = at & ((1u << level) - 1u);
  return uvec2(field_place((at >> level) - FIELD_ATLAS_APRON, level, 0u),
               ((inner + size - 1u) >> level) + 1u + 2u * FIELD_ATLAS_APRON);
}

// Levels lie in the order of their numbers: the first word of level `levels` is how many there are.
BTFC_FN FieldAtlasLevel field_atlas_level(BTFC_IN(FieldParams) p, uint level) {
  FieldAtlasLevel a;
  a.x = a.y = a.width = a.height = a.first = 0u;
  for (uint l = p.least_level; l <= level; ++l) {
    uvec2 x = field_atlas_axis(p.atlas_x, p.atlas_width, l, p.period);
    uvec2 y = field_atlas_axis(p.atlas_y, p.atlas_height, l, p.period);
    if (l > p.least_level) a.first += p.clusters * p.all_channels * a.width * a.height;
    a.x = x.x;
    a.y = y.x;
    a.width = x.y;
    a.height = y.y;
  }
  return a;
}

// Whether all texels that have a weight lie in `count` places from `first` on.
BTFC_FN bool field_atlas_covers(BTFC_IN(FieldWeights) w, uint first, uint count, uint level, uint period) {
  if (period != 0u) return true;
  for (uint i = 0u; i < 4u; ++i) {
    if (w.weight[i] != 0.0f && field_place(w.first + i - first, level, 0u) >= count) return false;
  }
  return true;
}

// The weighted sum of a plane's texels. Coarser levels are in them already.
BTFC_FN float field_atlas_value(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldAtlasLevel) a,
                                uint plane, uint level, BTFC_IN(FieldWeights) wx, BTFC_IN(FieldWeights) wy) {
  float sum = 0.0f;
  for (uint j = 0u; j < 4u; ++j) {
    for (uint i = 0u; i < 4u; ++i) {
      float w = wx.weight[i] * wy.weight[j];
      if (w == 0.0f) continue;
      uint x = field_place(wx.first + i - a.x, level, p.period);
      uint y = field_place(wy.first + j - a.y, level, p.period);
      sum += w * uintBitsToFloat(btfc_word(words, 2u, a.first + (plane * a.height + y) * a.width + x));
    }
  }
  return sum;
}

// The collapsed pyramid's value (paper eqs 3 and 5 undone): from the atlas where it reaches, or level by
// level.
BTFC_FN float field_value(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint subspace, uint factor,
                          BTFC_IN(FieldAt) at) {
  FieldWeights wx, wy;
  wx.first = at.x;
  wy.first = at.y;
  for (uint i = 0u; i < 4u; ++i) wx.weight[i] = wy.weight[i] = i == 0u ? 1.0f : 0.0f;
  float sum = 0.0f;
  for (uint level = at.level; level < p.levels; ++level) {
    if (level > at.level) {
      field_coarser(level - 1u, p.period, wx);
      field_coarser(level - 1u, p.period, wy);
    }
    if (level < at.smoothest) continue;
    if (level == at.smoothest && p.atlas_width != 0u) {
      FieldAtlasLevel a = field_atlas_level(p, level);
      if (field_atlas_covers(wx, a.x, a.width, level, p.period) &&
          field_atlas_covers(wy, a.y, a.height, level, p.period))
        return field_atlas_value(words, p, a, subspace * p.all_channels + factor, level, wx, wy);
    }
    for (uint j = 0u; j < 4u; ++j) {
      for (uint i = 0u; i < 4u; ++i) {
        float w = wx.weight[i] * wy.weight[j];
        if (w == 0.0f) continue;
        sum += w * field_band(words, p, subspace, factor, level, field_place(wx.first + i, level, p.period),
                              field_place(wy.first + j, level, p.period));
      }
    }
  }
  return sum;
}

// ---- records of subspaces

// mean d | basis d d (not car3d) | signature 4 | a factor: scale, rest of levels 1 … P-1, table K
BTFC_FN uint field_record_words(BTFC_IN(FieldParams) p) {
  uint d = p.all_channels;
  return d + (p.kind == FIELD_CAR3D ? 0u : d * d) + 4u + d * (p.levels + p.knots);
}
BTFC_FN uint field_factor_word(BTFC_IN(FieldParams) p, uint subspace, uint factor) {
  uint d = p.all_channels;
  return p.subspace_word + subspace * field_record_words(p) + d + (p.kind == FIELD_CAR3D ? 0u : d * d) + 4u +
         factor * (p.levels + p.knots);
}
BTFC_FN float field_number(BTFC_WORDS words, uint word) {
  return uintBitsToFloat(btfc_word(words, 0u, word));
}

// A table's value at z, -3 … 3, linear between knots.
BTFC_FN float field_knots(BTFC_WORDS words, uint table, uint knots, float z) {
  float at = (z + FIELD_TABLE_END) * (float(knots - 1u) / (2.0f * FIELD_TABLE_END));
  float last = float(knots - 1u);
  at = at > 0.0f ? (at < last ? at : last) : 0.0f;
  uint i = min(uint(at), knots - 2u);
  float a = field_number(words, table + i), b = field_number(words, table + i + 1u);
  return a + (at - float(i)) * (b - a);
}

// The marginal table of a factor. What finer levels would add is averaged over: three points of the normal
// distribution with the standard deviation `rest`.
BTFC_FN float field_marginal(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint factor_word, float value,
                             uint level) {
  if (p.knots == 0u) return value;
  float z = value * field_number(words, factor_word);
  uint table = factor_word + p.levels;
  if (level == 0u) return field_knots(words, table, p.knots, z);
  float away = 1.73205081f * field_number(words, factor_word + level);
  return (2.0f / 3.0f) * field_knots(words, table, p.knots, z) +
         (1.0f / 6.0f) *
             (field_knots(words, table, p.knots, z - away) + field_knots(words, table, p.knots, z + away));
}

// ---- subspaces of a pair of directions

// Up to four subspaces with their weights, sum 1.
struct FieldBlend {
  uvec4 subspace;
  vec4 weight;
  float gain;  // of deviations from the mean
};

BTFC_FN uint field_subspace(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint pair) {
  if (p.index_bits == 0u) return 0u;
  uint bit = pair * p.index_bits;
  uint word = btfc_word(words, 0u, p.index_word + (bit >> 5u)) >> (bit & 31u);
  uint left = 32u - (bit & 31u);
  if (left < p.index_bits) word |= btfc_word(words, 0u, p.index_word + (bit >> 5u) + 1u) << left;
  return word & ((1u << p.index_bits) - 1u);
}

// How much a blend's deviations have to grow to keep the variance of what is blended: sqrt(sum w_i v_i / v),
// v_i = |s_i|^2 + r_i^2 and v = |sum w_i s_i|^2 + sum w_i^2 r_i^2 with signatures (s, r).
BTFC_FN float field_gain(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldBlend) b) {
  vec3 sum = vec3(0.0f, 0.0f, 0.0f);
  float wanted = 0.0f, own = 0.0f;
  for (int i = 0; i < 4; ++i) {
    float w = b.weight[i];
    if (w == 0.0f) continue;
    uint d = p.all_channels;
    uint at =
        p.subspace_word + b.subspace[i] * field_record_words(p) + d + (p.kind == FIELD_CAR3D ? 0u : d * d);
    vec3 s = vec3(field_number(words, at), field_number(words, at + 1u), field_number(words, at + 2u));
    float r = field_number(words, at + 3u);
    wanted += w * (s.x * s.x + s.y * s.y + s.z * s.z + r * r);
    sum = vec3(sum.x + w * s.x, sum.y + w * s.y, sum.z + w * s.z);
    own += w * w * r * r;
  }
  float have = sum.x * sum.x + sum.y * sum.y + sum.z * sum.z + own;
  if (!(have > 0.0f)) return 1.0f;
  float gain = sqrt(wanted / have);
  return gain < 1.0f ? 1.0f : (gain < FIELD_MOST_GAIN ? gain : FIELD_MOST_GAIN);
}

// The four closest pairs of a view and a light: of the nine products of corner weights the four largest, each
// less the fifth, so that nothing jumps where the fourth and fifth change places.
BTFC_FN FieldBlend field_blend(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(vec3) view,
                               BTFC_IN(vec3) light) {
  BtfcCorners v = btfc_corners(words, p.views, view), l = btfc_corners(words, p.lights, light);
  float best[5];
  uint cell[5];
  for (int i = 0; i < 5; ++i) {
    best[i] = 0.0f;
    cell[i] = 0u;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float w = v.weight[i] * l.weight[j];
      uint own = v.index[i] * p.light_count + l.index[j];
      for (int k = 0; k < 5; ++k) {
        if (w <= best[k]) continue;
        float lower = best[k];
        uint moved = cell[k];
        best[k] = w;
        cell[k] = own;
        w = lower;
        own = moved;
      }
    }
  }
  FieldBlend b;
  b.subspace = uvec4(0u, 0u, 0u, 0u);
  b.weight = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  float sum = 0.0f;
  for (int i = 0; i < 4; ++i) sum += best[i] - best[4];
  // Weights of one subspace are added up; nine equal weights leave no difference.
  for (int i = 0; i < 4; ++i) {
    float w = sum > 1e-6f ? (best[i] - best[4]) / sum : 0.25f;
    if (w == 0.0f) continue;
    uint pair = p.pairs == BTFC_NONE ? cell[i] : btfc_word(words, 0u, p.pairs + cell[i]);
    uint own = field_subspace(words, p, pair);
    int at = 0;
    while (at < i && !(b.subspace[at] == own && b.weight[at] > 0.0f)) ++at;
    b.subspace[at] = own;
    b.weight[at] += w;
  }
  b.gain = field_gain(words, p, b);
  return b;
}

// ---- the bump filter

// Height in texels at (u, v) texels from the tile's corner: bilinear, periodic.
BTFC_FN float field_height(BTFC_WORDS words, BTFC_IN(FieldParams) p, float u, float v) {
  uint columns = p.range_size & 0xffffu, rows = p.range_size >> 16u;
  float x = u * (float(columns) / float(p.width)) - 0.5f, y = v * (float(rows) / float(p.height)) - 0.5f;
  int i = int(x + 65536.0f) - 65536, j = int(y + 65536.0f) - 65536;  // floor
  float a = x - float(i), b = y - float(j);
  uint i0 = btfc_wrap(i, columns, 1u), i1 = btfc_wrap(i + 1, columns, 1u);
  uint j0 = btfc_wrap(j, rows, 1u) * columns, j1 = btfc_wrap(j + 1, rows, 1u) * columns;
  uint at = p.range_word + 1u;
  float top = field_number(words, at + j0 + i0), bottom = field_number(words, at + j1 + i0);
  top = top + a * (field_number(words, at + j0 + i1) - top);
  bottom = bottom + a * (field_number(words, at + j1 + i1) - bottom);
  return top + b * (bottom - top);
}

// The texel of the tile where a texel of `level` begins. Without a period places stand for signed
// coordinates: a tile whose side is no power of two would have a seam at 0.
BTFC_FN uint field_tile_texel(BTFC_IN(FieldParams) p, uint at, uint level, uint size) {
  uint texel = at << level;
  return p.period == 0u ? btfc_wrap(int(texel), size, 1u) : texel % size;
}

// Its centre, in texels.
BTFC_FN float field_tile_place(BTFC_IN(FieldParams) p, uint at, uint level, uint size) {
  return float(field_tile_texel(p, at, level, size)) + 0.5f * float(1u << level);
}

const float FIELD_LEAST_COSINE = 0.1f;
const float FIELD_MOST_SHADE = 2.0f;
const int FIELD_SHADOW_STEPS = 32;

// How the heights rise at (u, v) along the rows, and down the columns.
BTFC_FN vec2 field_slopes(BTFC_WORDS words, BTFC_IN(FieldParams) p, float u, float v) {
  float du = 0.5f * float(p.width) / float(p.range_size & 0xffffu);
  float dv = 0.5f * float(p.height) / float(p.range_size >> 16u);
  return vec2((field_height(words, p, u + du, v) - field_height(words, p, u - du, v)) / (2.0f * du),
              (field_height(words, p, u, v + dv) - field_height(words, p, u, v - dv)) / (2.0f * dv));
}

// The cosine between light and normal over that of level ground (J. Blinn 1978), within 0 … 2. The normal is
// (-along, down, 1): y points to the image's top.
BTFC_FN float field_slope_shade(BTFC_IN(vec2) slopes, BTFC_IN(vec3) light) {
  vec3 l = btfc_upper_unit(light);
  float cosine =
      (l.z + slopes.y * l.y - slopes.x * l.x) / sqrt(1.0f + slopes.x * slopes.x + slopes.y * slopes.y);
  float shade = cosine / (l.z > FIELD_LEAST_COSINE ? l.z : FIELD_LEAST_COSINE);
  return shade > 0.0f ? (shade < FIELD_MOST_SHADE ? shade : FIELD_MOST_SHADE) : 0.0f;
}

// What the range map makes of the light at (u, v): 1 on level ground.
BTFC_FN float field_relief(BTFC_WORDS words, BTFC_IN(FieldParams) p, float u, float v, BTFC_IN(vec3) light) {
  float strength = field_number(words, p.range_word);
  float shade = field_slope_shade(field_slopes(words, p, u, v), light);
  if ((p.options & FIELD_SHADOW) != 0u) {
    vec3 l = btfc_upper_unit(light);
    float flat_length = sqrt(l.x * l.x + l.y * l.y);
    if (flat_length > 1e-3f) {
      float reach = float(p.width) / float(p.range_size & 0xffffu), here = field_height(words, p, u, v);
      float dx = l.x / flat_length, dy = -l.y / flat_length, rise = l.z / flat_length;
      for (int i = 1; i <= FIELD_SHADOW_STEPS; ++i) {
        float s = reach * float(i);
        if (field_height(words, p, u + s * dx, v + s * dy) > here + s * rise) {
          shade = 0.0f;
          break;
        }
      }
    }
  }
  return 1.0f + strength * (shade - 1.0f);
}

const float FIELD_MOST_PARALLAX = 64.0f;

// The texel that is seen where the surface, its height taken once, stands out: shifted along the view.
BTFC_FN ivec2 field_parallax(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query,
                             BTFC_IN(FieldAt) at) {
  vec3 v = btfc_upper_unit(query.view);
  float cosine = v.z > FIELD_LEAST_COSINE ? v.z : FIELD_LEAST_COSINE;
  float h = field_height(words, p, field_tile_place(p, at.x, at.level, p.width),
                         field_tile_place(p, at.y, at.level, p.height));
  float unit = h / (cosine * float(1u << at.level));
  float dx = -unit * v.x, dy = unit * v.y;
  float most = FIELD_MOST_PARALLAX;
  dx = dx > -most ? (dx < most ? dx : most) : -most;
  dy = dy > -most ? (dy < most ? dy : most) : -most;
  // A sum of unsigned numbers wraps, as coordinates do.
  return ivec2(int(uint(query.texel.x) + uint(int(dx + 128.5f) - 128)),
               int(uint(query.texel.y) + uint(int(dy + 128.5f) - 128)));
}

// ---- a texel

// A subspace's deviation from its mean, of the map's channels (inverse Karhunen-Loeve transform).
BTFC_FN vec4 field_deviation(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint subspace, BTFC_IN(FieldAt) at) {
  uint d = p.all_channels;
  uint basis = p.subspace_word + subspace * field_record_words(p) + d;
  vec4 sum = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (uint f = 0u; f < d; ++f) {
    if (p.kind == FIELD_CAR3D && (f < p.first_channel || f >= p.first_channel + p.channels)) continue;
    float t = field_marginal(words, p, field_factor_word(p, subspace, f),
                             field_value(words, p, subspace, f, at), at.smoothest);
    for (uint c = 0u; c < p.channels; ++c) {
      uint channel = p.first_channel + c;
      if (p.kind == FIELD_CAR3D) {
        if (channel == f) sum[int(c)] += t;
      } else {
        sum[int(c)] += field_number(words, basis + channel * d + f) * t;
      }
    }
  }
  return sum;
}

BTFC_FN vec4 field_mean(BTFC_WORDS words, BTFC_IN(FieldParams) p, uint subspace) {
  uint at = p.subspace_word + subspace * field_record_words(p) + p.first_channel;
  vec4 mean = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (uint c = 0u; c < p.channels; ++c) mean[int(c)] = field_number(words, at + c);
  return mean;
}

// The light's part of a value at a place.
BTFC_FN float field_shade(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldAt) at,
                          BTFC_IN(vec3) light) {
  if (p.range_size == 0u || (p.options & FIELD_NO_RELIEF) != 0u) return 1.0f;
  return field_relief(words, p, field_tile_place(p, at.x, at.level, p.width),
                      field_tile_place(p, at.y, at.level, p.height), light);
}

BTFC_FN bool field_shifts(BTFC_IN(FieldParams) p) {
  return p.range_size != 0u && (p.options & FIELD_PARALLAX) != 0u;
}

BTFC_FN vec4 field_eval(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query) {
  BtfcQuery seen = query;
  FieldAt at = field_at(p, seen);
  if (field_shifts(p)) {
    seen.texel = field_parallax(words, p, seen, at);
    at = field_at(p, seen);
  }
  FieldBlend b = field_blend(words, p, seen.view, seen.light);
  vec4 mean = vec4(0.0f, 0.0f, 0.0f, 0.0f), deviation = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 4; ++i) {
    float w = b.weight[i];
    if (w == 0.0f) continue;
    vec4 m = field_mean(words, p, b.subspace[i]), v = field_deviation(words, p, b.subspace[i], at);
    mean = mean + w * m;
    deviation = deviation + w * v;
  }
  float shade = field_shade(words, p, at, seen.light);
  return (mean + b.gain * deviation) * shade;
}

BTFC_END
#endif
