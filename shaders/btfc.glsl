// btfc.glsl - what an engine includes: any texel of a btfc texture, or a filtered sample of it, in any stage.
// There are no bindings inside. Before the inclusion define
//
//   uint btfc_fetch(uint handle, uint slot, uint index)   word `index` of word array `slot`, 0 to 3
//   uint btfc_fetch_size(uint handle, uint slot)          how many words it has (robust mode alone calls it)
//   uint btfc_param(uint handle, uint index)              word `index` of the map's parameters
//
// `handle` is yours: it is passed through, and says which texture is meant where a shader has several. Of
// these, what is not defined becomes a specialisation constant:
//
//   BTFC_MODEL    id 0   the model, its number of spec/registry.md: what a pipeline does not need falls away
//   BTFC_ROBUST   id 1   1: data that no loader has checked; indices and loops are bounded, results finite
//   BTFC_FILTER   id 2   1: btfc_sample interpolates between texels where they are larger than the footprint
//
// btfc_bindings.glsl is a ready set of all that. spec/shaders.md has the words, and the Vulkan around them.
#ifndef BTFC_GLSL
#define BTFC_GLSL

#ifndef BTFC_MODEL
layout(constant_id = 0) const uint BTFC_MODEL = 1u;
#endif
#ifndef BTFC_ROBUST
layout(constant_id = 1) const uint BTFC_ROBUST = 0u;
#endif
#ifndef BTFC_FILTER
layout(constant_id = 2) const uint BTFC_FILTER = 0u;
#endif
// Taps a side of the box that stands for the footprint where a model has none of its own.
#ifndef BTFC_MOST_TAPS
#define BTFC_MOST_TAPS 4u
#endif

// What the models' headers read words by, and keep by within bounds what nobody may have checked: ends of loops,
// divisors.
uint btfc_word(uint handle, uint slot, uint index) {
  if (BTFC_ROBUST == 0u) return btfc_fetch(handle, slot, index);
  uint size = slot < 4u ? btfc_fetch_size(handle, slot) : 0u;
  return size == 0u ? 0u : btfc_fetch(handle, slot, min(index, size - 1u));
}
uint btfc_bound(uint value, uint most) { return BTFC_ROBUST == 0u ? value : min(value, most); }
uint btfc_least(uint value, uint least) { return BTFC_ROBUST == 0u ? value : max(value, least); }

#include "btfc_model_ids.h"
#include "btfc_query.h"
#include "btfc_uv.h"
#include "models/field.h"
#include "models/gm.h"
#include "models/lpca.h"
#include "models/patch.h"
#include "models/pca.h"
#include "models/pcarf.h"
#include "models/plm.h"
#include "models/ptm.h"

// ---- the eval dispatch: a row a model

vec4 btfc_eval_unchecked(uint handle, BtfcQuery query) {
  if (BTFC_MODEL == BTFC_MODEL_PATCH) return patch_eval(handle, patch_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_GM) return gm_eval(handle, gm_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_PTM) return ptm_eval(handle, ptm_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_PLM) return plm_eval(handle, plm_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_PCARF) return pcarf_eval(handle, pcarf_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_PCA) return pca_eval(handle, pca_params(handle), query);
  if (BTFC_MODEL == BTFC_MODEL_LPCA) return lpca_eval(handle, lpca_params(handle), query);
  return field_eval(handle, field_params(handle), query);
}

// What untrusted data may make of a value that was to be finite.
vec4 btfc_settle_value(vec4 value) {
  if (BTFC_ROBUST == 0u) return value;
  return vec4(btfc_finite(value.x) ? value.x : 0.0f, btfc_finite(value.y) ? value.y : 0.0f,
              btfc_finite(value.z) ? value.z : 0.0f, btfc_finite(value.w) ? value.w : 0.0f);
}

// The texel of a query, as btfc_eval of the CPU gives it. Channels that the map lacks are undefined.
vec4 btfc_eval(uint handle, BtfcQuery query) { return btfc_settle_value(btfc_eval_unchecked(handle, query)); }

// ---- samples at texture coordinates

struct BtfcExtent {
  uint width, height, wrap_u, wrap_v;
  bool own_footprint;  // the model filters by itself
};

BtfcExtent btfc_extent(uint handle) {
  bool is_field = BTFC_MODEL == BTFC_MODEL_CAR || BTFC_MODEL == BTFC_MODEL_GMRF || BTFC_MODEL == BTFC_MODEL_CAR3D;
  uint wrap_u = btfc_param(handle, 2u), wrap_v = btfc_param(handle, 3u);
  if (BTFC_MODEL == BTFC_MODEL_PATCH) wrap_v = wrap_u;
  if (is_field) wrap_u = wrap_v = BTFC_UNBOUNDED;
  return BtfcExtent(max(btfc_param(handle, 0u), 1u), max(btfc_param(handle, 1u), 1u), wrap_u, wrap_v,
                    is_field || BTFC_MODEL == BTFC_MODEL_GM);
}

// uv: 0 … 1 over the texture (of unbounded ones: over the analysed tile), v downwards; beyond, the file's wrap rule
// applies. view, light: away from the surface, in its frame of tangent (u), bitangent (towards smaller v) and normal;
// any length. footprint: texels that a pixel covers, along the longer way. Whatever the bits of the arguments, the
// result is finite.
vec4 btfc_sample(uint handle, vec2 uv, vec3 view, vec3 light, float footprint) {
  BtfcExtent extent = btfc_extent(handle);
  BtfcQuery query;
  query.level = 0u;
  query.view = btfc_finite_direction(view);
  query.light = btfc_finite_direction(light);
  query.footprint = btfc_finite_footprint(footprint);
  vec2 place = vec2(btfc_place(uv.x, extent.width, extent.wrap_u), btfc_place(uv.y, extent.height, extent.wrap_v));
  // A mixture has a value between texels, too.
  if (BTFC_FILTER != 0u && BTFC_MODEL == BTFC_MODEL_GM)
    return btfc_settle_value(gm_eval_at(handle, gm_params(handle), query, place.x, place.y));
  // Four texels by the place's distances from their centres, or a box of taps as large as the footprint.
  bool between = BTFC_FILTER != 0u && query.footprint < 2.0f;
  uint taps = between ? 2u : (extent.own_footprint ? 1u : min(uint(ceil(query.footprint)), BTFC_MOST_TAPS));
  vec2 corner = place - 0.5f;
  vec2 part = corner - floor(corner);
  vec4 sum = vec4(0.0f);
  for (uint i = 0u; i < taps * taps; ++i) {
    vec2 tap = vec2(i % taps, i / taps);
    vec2 at = between ? floor(corner) + tap : place + ((tap + 0.5f) / float(taps) - 0.5f) * query.footprint;
    query.texel = ivec2(btfc_place_texel(at.x), btfc_place_texel(at.y));
    vec2 weight = between ? abs(1.0f - tap - part) : vec2(1.0f / float(taps));
    sum += weight.x * weight.y * btfc_eval(handle, query);
  }
  return sum;
}

#endif
