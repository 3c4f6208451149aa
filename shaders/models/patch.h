// Model patch: a texel from at most four patches of the sample (spec/models/patch.md section 4).
// Everything is integer arithmetic but the float16 lerp, whose one rounding step the page fixes.
#ifndef BTFC_PATCH_H
#define BTFC_PATCH_H
#include "../btfc_plane.h"
#include "../btfc_query.h"

BTFC_BEGIN

// Word slots.
const uint PATCH_COORDINATES = 0u;
const uint PATCH_CUTS_V = 1u;
const uint PATCH_CUTS_H = 2u;
const uint PATCH_SAMPLE = 3u;

const uint PATCH_LIANG = 0u;
const uint PATCH_QUILTING = 1u;

// One map's parameters; 4-byte scalars only, so that C++, std430 and scalar layout agree.
struct PatchParams {
  uint width;  // texels of the texture
  uint height;
  uint wraps;         // 1: the texture repeats, and border patches overlap those of the other side
  uint sample_width;  // texels
  uint patch_count_x;
  uint patch_count_y;
  uint patch_size;  // w_B
  uint overlap;     // w_E
  uint blend;       // PATCH_LIANG, PATCH_QUILTING
  uint wide;        // 1: a word a coordinate pair, 0: two pairs a word
  uint cut_bits;    // bits an entry; 0: all entries are 0
  uint cut_stride;  // bits from one cut to the next
  uint plane_word;  // where the map begins in slot PATCH_SAMPLE
  uint texel_bits;
  uint sample_type;
};

#ifndef __cplusplus
// From words; in robust mode within what loops and divisions bear.
PatchParams patch_params(uint handle) {
  PatchParams p = PatchParams(BTFC_P4(0u), BTFC_P4(4u), BTFC_P4(8u), BTFC_P(12u), BTFC_P(13u), BTFC_P(14u));
  p.overlap = btfc_least(p.overlap, 1u);
  p.patch_size = btfc_least(p.patch_size, p.overlap + 1u);
  p.patch_count_x = btfc_least(p.patch_count_x, 1u);
  p.patch_count_y = btfc_least(p.patch_count_y, 1u);
  return p;
}
#endif

// Patch (i, j) = column and row in the grid of patches.
BTFC_FN uvec2 patch_coordinates(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j) {
  uint number = j * p.patch_count_x + i;
  if (p.wide == 1u) {
    uint word = btfc_word(words, PATCH_COORDINATES, number);
    return uvec2(word & 0xffffu, word >> 16u);
  }
  uint pair = btfc_word(words, PATCH_COORDINATES, number >> 1u) >> ((number & 1u) * 16u);
  return uvec2(pair & 0xffu, (pair >> 8u) & 0xffu);
}

// Entry t of a cut. An entry may straddle two words in the packed layout.
BTFC_FN uint patch_cut(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint slot, uint cut, uint t) {
  if (p.cut_bits == 0u) return 0u;
  uint bit = cut * p.cut_stride + t * p.cut_bits;
  uint word = bit >> 5u;
  uint shift = bit & 31u;
  uint value = btfc_word(words, slot, word) >> shift;
  if (shift + p.cut_bits > 32u) value |= btfc_word(words, slot, word + 1u) << (32u - shift);
  return value & ((1u << p.cut_bits) - 1u);
}

// Numbers of the cuts of patch (i, j): towards its left neighbour, towards the row above.
BTFC_FN uint patch_number_v(BTFC_IN(PatchParams) p, uint i, uint j) {
  return p.wraps == 1u ? j * p.patch_count_x + i : j * (p.patch_count_x - 1u) + i - 1u;
}
BTFC_FN uint patch_number_h(BTFC_IN(PatchParams) p, uint i, uint j) {
  return (p.wraps == 1u ? j : j - 1u) * p.patch_count_x + i;
}

// The cut between patch (i, j) and its left neighbour, at local row v.
BTFC_FN uint patch_cut_v(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j, uint v) {
  return patch_cut(words, p, PATCH_CUTS_V, patch_number_v(p, i, j), v);
}

// The cut between patch (i, j) and the one above, at local column u.
BTFC_FN uint patch_cut_h(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j, uint u) {
  return patch_cut(words, p, PATCH_CUTS_H, patch_number_h(p, i, j), u);
}

// The sample's codes that patch (i, j) shows at local (u, v).
BTFC_FN uvec4 patch_texel(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j, uint u, uint v) {
  uvec2 at = patch_coordinates(words, p, i, j);
  uint sample_bits = p.sample_type == BTFC_CODE_UNORM8 ? 8u : 16u;
  return btfc_plane_codes(words, PATCH_SAMPLE, p.plane_word, p.texel_bits, sample_bits,
                          (at.y + v) * p.sample_width + at.x + u);
}

// Feathering weight of the later patch at a texels into an overlap of w_E, in 1/256.
BTFC_FN uint patch_weight(uint a, uint overlap) { return (256u * (2u * a + 1u) + overlap) / (2u * overlap); }

BTFC_FN uint patch_lerp_code(uint sample_type, uint a, uint b, uint w) {
  if (sample_type == BTFC_CODE_FLOAT16) {
    BTFC_PRECISE float left = btfc_half_to_float(a) * float(256u - w);  // exact: 11 + 9 bits
    BTFC_PRECISE float right = btfc_half_to_float(b) * float(w);
    BTFC_PRECISE float sum = left + right;
    uint half_bits = btfc_float_to_half(sum * 0.00390625f);
    return (half_bits & 0x7fffu) == 0u ? 0u : half_bits;
  }
  return (a * (256u - w) + b * w + 128u) >> 8u;
}

BTFC_FN uvec4 patch_lerp(uint sample_type, BTFC_IN(uvec4) a, BTFC_IN(uvec4) b, uint w) {
  return uvec4(patch_lerp_code(sample_type, a.x, b.x, w), patch_lerp_code(sample_type, a.y, b.y, w),
               patch_lerp_code(sample_type, a.z, b.z, w), patch_lerp_code(sample_type, a.w, b.w, w));
}

// Quilting: the patch that shows at local (u, v) of patch (i, j), the last one that covers the texel, and
// where: (i, j, u, v) of it.
BTFC_FN uvec4 patch_shown(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j, uint u, uint v) {
  uint step = p.patch_size - p.overlap;
  bool in_left = (i > 0u || p.wraps == 1u) && u < p.overlap;
  bool in_above = (j > 0u || p.wraps == 1u) && v < p.overlap;
  uint left = i > 0u ? i - 1u : p.patch_count_x - 1u;  // used in overlaps only
  uint above = j > 0u ? j - 1u : p.patch_count_y - 1u;
  uint top_i = i;
  uint top_u = u;
  if (in_left && u < patch_cut_v(words, p, i, j, v)) {
    top_i = left;
    top_u = u + step;
  }
  if (!in_above || v >= patch_cut_h(words, p, top_i, j, top_u)) return uvec4(top_i, j, top_u, v);
  if (in_left && u < patch_cut_v(words, p, i, above, v + step)) {
    return uvec4(left, above, u + step, v + step);
  }
  return uvec4(i, above, u, v + step);
}

// Codes of the texel at local (u, v) of patch (i, j), where that patch is the last one that covers it.
BTFC_FN uvec4 patch_codes_at(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint i, uint j, uint u, uint v) {
  if (p.blend == PATCH_QUILTING) {
    uvec4 shown = patch_shown(words, p, i, j, u, v);
    return patch_texel(words, p, shown.x, shown.y, shown.z, shown.w);
  }
  uint step = p.patch_size - p.overlap;
  bool in_left = (i > 0u || p.wraps == 1u) && u < p.overlap;
  bool in_above = (j > 0u || p.wraps == 1u) && v < p.overlap;
  uint left = i > 0u ? i - 1u : p.patch_count_x - 1u;  // used in overlaps only
  uint above = j > 0u ? j - 1u : p.patch_count_y - 1u;
  uint across = in_left ? patch_weight(u, p.overlap) : 256u;
  uvec4 row = patch_texel(words, p, i, j, u, v);
  if (in_left) row = patch_lerp(p.sample_type, patch_texel(words, p, left, j, u + step, v), row, across);
  if (!in_above) return row;
  uvec4 upper = patch_texel(words, p, i, above, u, v + step);
  if (in_left) {
    upper = patch_lerp(p.sample_type, patch_texel(words, p, left, above, u + step, v + step), upper, across);
  }
  return patch_lerp(p.sample_type, upper, row, patch_weight(v, p.overlap));
}

// Codes of texel (x, y) inside the texture.
BTFC_FN uvec4 patch_codes(BTFC_WORDS words, BTFC_IN(PatchParams) p, uint x, uint y) {
  uint step = p.patch_size - p.overlap;
  uint i = min(x / step, p.patch_count_x - 1u);
  uint j = min(y / step, p.patch_count_y - 1u);
  return patch_codes_at(words, p, i, j, x - i * step, y - j * step);
}

// The answer for any query: codes, then values.
BTFC_FN uvec4 patch_eval_codes(BTFC_WORDS words, BTFC_IN(PatchParams) p, BTFC_IN(BtfcQuery) q) {
  return patch_codes(words, p, btfc_wrap(q.texel.x, p.width, p.wraps),
                     btfc_wrap(q.texel.y, p.height, p.wraps));
}

BTFC_FN vec4 patch_eval(BTFC_WORDS words, BTFC_IN(PatchParams) p, BTFC_IN(BtfcQuery) q) {
  return btfc_code_values(p.sample_type, patch_eval_codes(words, p, q));
}

BTFC_END
#endif
