// The prepare passes of models car, gmrf and car3d: level by level from the coarsest, the recursions of all
// planes (spec/models/car.md section 5.2) into a scratch, and from there the collapse (5.4) into the atlas
// that field_value() reads. The scratch and the atlas are the includer's, as words are.
#ifndef BTFC_FIELD_PREPARE_H
#define BTFC_FIELD_PREPARE_H
#include "field.h"

#ifdef __cplusplus
namespace btfc {
struct FieldMemory {
  float* scratch;
  float* atlas;
};
inline float field_scratch_load(const FieldMemory& memory, uint index) { return memory.scratch[index]; }
inline void field_scratch_store(const FieldMemory& memory, uint index, float value) {
  memory.scratch[index] = value;
}
inline float field_atlas_load(const FieldMemory& memory, uint index) { return memory.atlas[index]; }
inline void field_atlas_store(const FieldMemory& memory, uint index, float value) {
  memory.atlas[index] = value;
}
}  // namespace btfc
#define FIELD_MEMORY const FieldMemory&
#else
// The includer defines field_scratch_load() and the other three.
#define FIELD_MEMORY uint
#endif

BTFC_BEGIN

// ---- units of work: a level's part of the atlas falls into tiles, each with margins of its own, so that a
// wide window has no long chain of texels that wait for each other. A unit is a tile of a plane; of car3d one
// of all factors of a subspace.

const uint FIELD_TILE_MOST = 320u;  // texels a side

struct FieldTiles {
  uint across, down, width, height;  // tiles; texels of one, the last ones may be smaller
};

BTFC_FN uvec2 field_tiles_axis(uint size) {
  uint count = (size + FIELD_TILE_MOST - 1u) / FIELD_TILE_MOST;
  uint tile = (size + count - 1u) / count;
  return uvec2((size + tile - 1u) / tile, tile);
}

BTFC_FN FieldTiles field_tiles(BTFC_IN(FieldAtlasLevel) a) {
  uvec2 x = field_tiles_axis(a.width), y = field_tiles_axis(a.height);
  FieldTiles t;
  t.across = x.x;
  t.down = y.x;
  t.width = x.y;
  t.height = y.y;
  return t;
}

// Factors that one unit makes.
BTFC_FN uint field_unit_factors(BTFC_IN(FieldParams) p) {
  return p.kind == FIELD_CAR3D ? p.all_channels : 1u;
}

struct FieldUnit {
  uint subspace, factor;  // the first one
  uint x, y;              // from the level's first texel
  uint width, height;
  uint margin, columns, rows;  // of the recursion: above, left and right
  uint factors;
};

BTFC_FN FieldUnit field_unit(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldAtlasLevel) a, uint level,
                             uint unit) {
  FieldTiles t = field_tiles(a);
  FieldUnit u;
  u.factors = field_unit_factors(p);
  uint plane = unit / (t.across * t.down) * u.factors, tile = unit % (t.across * t.down);
  u.subspace = plane / p.all_channels;
  u.factor = plane % p.all_channels;
  u.x = tile % t.across * t.width;
  u.y = tile / t.across * t.height;
  u.width = min(t.width, a.width - u.x);
  u.height = min(t.height, a.height - u.y);
  u.margin = p.kind == FIELD_GMRF ? 0u : field_level(words, p, level, 0u);
  u.columns = u.width + 2u * u.margin;
  u.rows = u.height + u.margin;
  return u;
}

// Words of scratch from one unit to the next.
BTFC_FN uint field_unit_words(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldAtlasLevel) a,
                              uint level) {
  if (p.kind == FIELD_GMRF) return 0u;
  FieldTiles t = field_tiles(a);
  uint margin = field_level(words, p, level, 0u);
  return (t.width + 2u * margin) * (t.height + margin) * field_unit_factors(p);
}

// ---- the recursion

// Invocations of a workgroup: each has a row, and lies FIELD_LAG columns behind the one above it. A neighbour
// lies at most four columns to the right.
const uint FIELD_LANES = 64u;
const int FIELD_LAG = 5;

// A unit's recursion: where its first texel lies on the level's lattice, its neighbourhood and numbers in
// slot 0, and its scratch.
struct FieldRun {
  uint level, place_x, place_y;
  uint masks, numbers;
  uint neighbours;  // of car3d
  uint first;
};

BTFC_FN uint field_mask_size(BTFC_WORDS words, uint mask) {
  return field_bits(btfc_word(words, 0u, mask)) + field_bits(btfc_word(words, 0u, mask + 1u));
}

// A place `back` texels before at + first; with a period a window may be longer than it.
BTFC_FN uint field_place_before(uint first, uint at, uint back, uint level, uint period) {
  uint whole = period == 0u ? 0u : period >> level;
  return field_place(first + at + (whole == 0u ? 0u - back : whole - back % whole), level, period);
}

// first: the unit's first word of scratch.
BTFC_FN FieldRun field_run(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(FieldAtlasLevel) a,
                           BTFC_IN(FieldUnit) u, uint level, uint first) {
  FieldRun run;
  run.level = level;
  run.first = first;
  run.place_x = field_place_before(a.x, u.x, u.margin, level, p.period);
  run.place_y = field_place_before(a.y, u.y, u.margin, level, p.period);
  uint d = p.all_channels, masks = field_level(words, p, level, 3u);
  if (p.kind == FIELD_CAR3D) {
    run.masks = masks;
    run.neighbours = field_mask_size(words, masks);
    run.numbers = masks + 2u + u.subspace * (d * (d + 1u) / 2u + run.neighbours * d * d);
    return run;
  }
  run.masks = masks + 2u * u.factor;
  run.neighbours = field_mask_size(words, run.masks);
  uint record = 0u, own = 0u;
  for (uint f = 0u; f < d; ++f) {
    if (f == u.factor) own = record;
    record += 1u + field_mask_size(words, masks + 2u * f);
  }
  run.numbers = masks + 2u * d + u.subspace * record + own;
  return run;
}

// One factor's value at a texel of the unit, all that come before it being there. Terms go to four partial
// sums in turn; they go round instead of the index.
BTFC_FN float field_recursion_value(BTFC_WORDS words, FIELD_MEMORY memory, BTFC_IN(FieldParams) p,
                                    BTFC_IN(FieldUnit) u, BTFC_IN(FieldRun) run, uint f, uint x, uint y) {
  bool coupled = p.kind == FIELD_CAR3D;
  uint d = p.all_channels;
  uint place_x = field_place(run.place_x + x, run.level, p.period);
  uint place_y = field_place(run.place_y + y, run.level, p.period);
  uint number = coupled ? run.numbers + f * (f + 1u) / 2u : run.numbers;
  BTFC_PRECISE vec4 sums = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  for (uint g = coupled ? 0u : f; g <= f; ++g) {
    int e = field_noise_integer(place_x, place_y, field_stream(p.seed, run.level, g));
    BTFC_PRECISE float unit = float(e) * FIELD_NOISE_UNIT;
    BTFC_PRECISE float product = field_number(words, number) * unit;
    sums.x = sums.x + product;
    ++number;
  }
  uint step = 1u;  // of coefficients, a neighbour
  if (coupled) {
    number = run.numbers + d * (d + 1u) / 2u + f * d;
    step = d * d;
  }
  for (uint part = 0u; part < 2u; ++part) {
    uint mask = btfc_word(words, 0u, run.masks + part);
    while (mask != 0u) {
      uint candidate = 32u * part + field_bits((mask & (0u - mask)) - 1u);
      mask &= mask - 1u;
      // The column to the left of the unit is above all columns as an unsigned number, and so are rows.
      uint from_x = x + candidate % 9u - 4u, from_y = y + candidate / 9u - 4u;
      bool inside = from_x < u.columns && from_y < u.rows;
      for (uint g = 0u; g < u.factors; ++g) {
        float before = 0.0f;
        if (inside)
          before = field_scratch_load(memory, run.first + (g * u.rows + from_y) * u.columns + from_x);
        BTFC_PRECISE float product = field_number(words, number + g) * before;
        BTFC_PRECISE float sum = sums.x + product;
        sums = vec4(sums.y, sums.z, sums.w, sum);
      }
      number += step;
    }
  }
  BTFC_PRECISE float even = (sums.x + sums.y) + (sums.z + sums.w);
  BTFC_PRECISE float odd = (sums.w + sums.x) + (sums.y + sums.z);
  return (run.neighbours * u.factors) % 2u == 0u ? even : odd;
}

// All factors of a unit at a texel, margins counted.
BTFC_FN void field_recursion(BTFC_WORDS words, FIELD_MEMORY memory, BTFC_IN(FieldParams) p,
                             BTFC_IN(FieldUnit) u, BTFC_IN(FieldRun) run, uint x, uint y) {
  for (uint i = 0u; i < u.factors; ++i) {
    float value = field_recursion_value(words, memory, p, u, run, u.factor + i, x, y);
    field_scratch_store(memory, run.first + (i * u.rows + y) * u.columns + x, value);
  }
}

// Where an invocation is at a step: it walks along its row, and then along the row FIELD_LANES farther down.
// Columns outside the unit are waited through: as many that the row above, another invocation's or its own,
// is ahead. All have to see the texels of a step before the next one.
struct FieldWalk {
  int x;
  uint y, pitch;
};

BTFC_FN uint field_walk_pitch(BTFC_IN(FieldUnit) u) { return max(u.columns, uint(FIELD_LAG) * FIELD_LANES); }

BTFC_FN FieldWalk field_walk_begin(BTFC_IN(FieldUnit) u, uint lane, uint step) {
  FieldWalk walk;
  walk.pitch = field_walk_pitch(u);
  walk.x = int(step) - FIELD_LAG * int(lane);
  walk.y = lane;
  if (walk.x < 0) return walk;
  walk.y += uint(walk.x) / walk.pitch * FIELD_LANES;
  walk.x = int(uint(walk.x) % walk.pitch);
  return walk;
}
BTFC_FN bool field_walk_inside(BTFC_IN(FieldUnit) u, BTFC_IN(FieldWalk) walk) {
  return walk.x >= 0 && uint(walk.x) < u.columns && walk.y < u.rows;
}
BTFC_FN void field_walk_on(BTFC_INOUT(FieldWalk) walk) {
  ++walk.x;
  if (walk.x < int(walk.pitch)) return;
  walk.x = 0;
  walk.y += FIELD_LANES;
}
// Steps until all invocations are through.
BTFC_FN uint field_walk_steps(BTFC_IN(FieldUnit) u) {
  uint rounds = (u.rows + FIELD_LANES - 1u) / FIELD_LANES;
  return (rounds - 1u) * field_walk_pitch(u) + u.columns + uint(FIELD_LAG) * (FIELD_LANES - 1u);
}

// ---- the collapse

// A place's distance from the first one of a coarser level's part. `ahead` is -1, 0 or 1 as a difference.
BTFC_FN uint field_coarse_at(uint place, uint ahead, uint first, uint level, uint period) {
  uint whole = period == 0u ? 0u : period >> level;
  return field_place(place / 2u + ahead + whole - first, level, period);
}

// (1, 6, 1) / 8 of a, b, c, or (1, 1) / 2 of b, c.
BTFC_FN float field_expanded(bool odd, float a, float b, float c) {
  BTFC_PRECISE float at_odd = 0.5f * b + 0.5f * c;
  BTFC_PRECISE float at_even = 0.125f * a + 0.75f * b + 0.125f * c;
  return odd ? at_odd : at_even;
}

// The value of one texel (x, y) of a unit, its own factor number i: what the level has, first being the
// unit's first word of scratch, and what the coarser ones have, which the atlas holds already.
BTFC_FN void field_collapse_texel(BTFC_WORDS words, FIELD_MEMORY memory, BTFC_IN(FieldParams) p,
                                  BTFC_IN(FieldAtlasLevel) a, BTFC_IN(FieldUnit) u, uint level, uint first,
                                  uint i, uint x, uint y) {
  uint at_x = u.x + x, at_y = u.y + y;
  uint place_x = field_place(a.x + at_x, level, p.period), place_y = field_place(a.y + at_y, level, p.period);
  uint plane = u.subspace * p.all_channels + u.factor + i;
  BTFC_PRECISE float value = 0.0f;
  if (p.kind == FIELD_GMRF) {
    value = field_band(words, p, u.subspace, u.factor + i, level, place_x, place_y);
  } else {
    value = field_scratch_load(memory, first + (i * u.rows + u.margin + y) * u.columns + u.margin + x);
  }
  if (level + 1u < p.levels) {
    FieldAtlasLevel c = field_atlas_level(p, level + 1u);
    bool odd_x = place_x % 2u != 0u, odd_y = place_y % 2u != 0u;
    float column[3];
    for (uint k = 0u; k < 3u; ++k) {
      uint from_x = field_coarse_at(place_x, k - 1u, c.x, level + 1u, p.period);
      float row[3];
      for (uint j = 0u; j < 3u; ++j) {
        uint from_y = field_coarse_at(place_y, j - 1u, c.y, level + 1u, p.period);
        row[j] = 0.0f;
        // Odd texels take nothing of the first ones, which may lie outside.
        if ((k == 0u && odd_x) || (j == 0u && odd_y)) continue;
        row[j] = field_atlas_load(memory, c.first + (plane * c.height + from_y) * c.width + from_x);
      }
      column[k] = field_expanded(odd_y, row[0], row[1], row[2]);
    }
    value = value + field_expanded(odd_x, column[0], column[1], column[2]);
  }
  field_atlas_store(memory, a.first + (plane * a.height + at_y) * a.width + at_x, value);
}

BTFC_END
#endif
