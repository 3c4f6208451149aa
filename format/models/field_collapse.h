// Levels of a loaded random field -> its factors' values in windows.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/loaded_item.h"
#include "format/models/field_payload.h"

namespace btfc {

// One level alone: out[(k * d + factor) * texels + texel] of subspaces[k].
void field_band_values(const LoadedItem& item, const FieldParams& p, std::uint32_t level,
                       std::span<const std::uint32_t> subspaces, const FieldWindow& window, float* out);

// What a coarser level must cover for expand_add to fill a window.
FieldWindow field_coarse_window(const FieldWindow& fine);

// fine += the next coarser level's values, expanded by 2 (paper eq. 5). coarse covers field_coarse_window.
void field_expand_add(const float* coarse, const FieldWindow& coarse_window, const FieldWindow& fine_window,
                      float* fine);

// Factors' values -> deviations of all channels from the subspace's mean (marginal tables, inverse
// Karhunen-Loeve transform), channels interleaved: of `count` texels, factor f's first at factors[f * plane].
void field_deviations(const BtfcWords& words, const FieldParams& p, std::uint32_t subspace,
                      std::uint32_t smoothest, const float* factors, std::size_t plane, std::size_t count,
                      float* out);

// The collapsed pyramid over a window of `level`, levels finer than `smoothest` left out: without tiles, from
// all coarser levels' windows.
std::vector<float> field_collapse(const LoadedItem& item, const FieldParams& p, std::uint32_t level,
                                  std::uint32_t smoothest, std::span<const std::uint32_t> subspaces,
                                  const FieldWindow& window);

}  // namespace btfc
