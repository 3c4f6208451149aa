// Sums of weighted images (pca, pcarf) and of weighted reflectances (lpca) along rows.
#include "decoder/table_values.h"

#include <bit>
#include <cstring>

#include "decoder/model_table.h"
#include "shaders/models/lpca.h"
#include "shaders/models/pca.h"
#include "shaders/models/pcarf.h"

namespace btfc {
namespace {

// Elements as they lie in words; little-endian.
struct Half {
  std::uint16_t bits;
};
float number(float element) { return element; }
float number(std::uint8_t element) { return static_cast<float>(element); }
float number(Half element) { return btfc_half_to_float(element.bits); }

template <class Element>
const Element* elements_of(const std::vector<std::uint32_t>& words) {
  return reinterpret_cast<const Element*>(words.data());
}

// A table of rows over slots 1 to 3, as an image of components and channels.
struct ImageRows {
  std::uint32_t rows_per_slot, components, all_channels, first_channel, channels;
};

// One weighted image a component: row first_row + texel of the table, state = for each component its weight,
// then offset and step of each channel.
template <class Element>
void add_images(const LoadedItem& item, const ImageRows& rows, std::uint32_t first_row, const float* state,
                std::uint32_t width, float* out) {
  const std::size_t stride = std::size_t{rows.components} * rows.all_channels;
  for (std::uint32_t t = 0; t < width; ++t) {
    const std::uint32_t row = first_row + t;
    const Element* element = elements_of<Element>(item.words[1 + row / rows.rows_per_slot]) +
                             row % rows.rows_per_slot * stride + rows.first_channel;
    const float* s = state;
    float* value = out + std::size_t{t} * rows.channels;
    for (std::uint32_t k = 0; k < rows.components; ++k, element += rows.all_channels) {
      const float weight = *s++;
      for (std::uint32_t c = 0; c < rows.channels; ++c, s += 2)
        value[c] += weight * (s[0] + s[1] * number(element[c]));
    }
  }
}

void add_images(const LoadedItem& item, const ImageRows& rows, std::uint32_t precision,
                std::uint32_t first_row, const float* state, std::uint32_t width, float* out) {
  if (precision == BTFC_F32) return add_images<float>(item, rows, first_row, state, width, out);
  if (precision == BTFC_F16) return add_images<Half>(item, rows, first_row, state, width, out);
  add_images<std::uint8_t>(item, rows, first_row, state, width, out);
}

// A weighted image's state: scales of the channels from number `first` on.
template <class Params>
void push_image(const BtfcWords& words, const Params& p, float weight, std::uint32_t first,
                std::vector<float>& state) {
  state.push_back(weight);
  for (std::uint32_t c = 0; c < p.channels; ++c) {
    const vec2 scale = btfc_scale(words, p.scale_word, first + c);
    state.insert(state.end(), {scale.x, scale.y});
  }
}

template <class Params>
ImageRows image_rows_of(const Params& p) {
  return {p.rows_per_slot, p.rank + 1, p.all_channels, p.first_channel, p.channels};
}

std::uint32_t first_texel(const LoadedItem& item, const BtfcQuery& query) {
  return static_cast<std::uint32_t>(query.texel.y) * item.head.width +
         static_cast<std::uint32_t>(query.texel.x);
}

}  // namespace

std::vector<float> pca_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  const auto p = params_of<PcaParams>(item, map);
  const BtfcWords words = words_of(item);
  const BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  const BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  std::vector<float> state;
  for (std::uint32_t k = 0; k <= p.rank; ++k) {
    const float weight = k == 0 ? 1.0f : pca_weight(words, p, view, light, k - 1);
    push_image(words, p, weight, k * p.all_channels + p.first_channel, state);
  }
  return state;
}

void pca_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                       const BtfcQuery& query, std::uint32_t width, float* out) {
  const auto p = params_of<PcaParams>(item, map);
  std::memset(out, 0, std::size_t{width} * p.channels * sizeof(float));
  add_images(item, image_rows_of(p), p.texel_precision, first_texel(item, query), state.data(), width, out);
}

// For each view that has weight: its number, then the state of its images.
std::vector<float> pcarf_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  const auto p = params_of<PcarfParams>(item, map);
  const BtfcWords words = words_of(item);
  const BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  const BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  std::vector<float> state;
  for (int i = 0; i < 3; ++i) {
    if (view.weight[i] == 0) continue;
    state.push_back(std::bit_cast<float>(view.index[i]));
    const std::uint32_t scales = view.index[i] * (p.rank + 1) * p.all_channels + p.first_channel;
    for (std::uint32_t k = 0; k <= p.rank; ++k) {
      float weight = view.weight[i];
      if (k > 0) weight *= pcarf_weight(words, p, view.index[i], light, k - 1);
      push_image(words, p, weight, scales + k * p.all_channels, state);
    }
  }
  return state;
}

void pcarf_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                         const BtfcQuery& query, std::uint32_t width, float* out) {
  const auto p = params_of<PcarfParams>(item, map);
  std::memset(out, 0, std::size_t{width} * p.channels * sizeof(float));
  const std::size_t of_view = 1 + std::size_t{p.rank + 1} * (1 + 2 * p.channels);
  for (std::size_t at = 0; at < state.size(); at += of_view) {
    const std::uint32_t first = std::bit_cast<std::uint32_t>(state[at]) * p.width * p.height;
    add_images(item, image_rows_of(p), p.texel_precision, first + first_texel(item, query), &state[at + 1],
               width, out);
  }
}

// Offset and step of each component's weights, then mu and E of every cluster: [cluster][component][channel].
std::vector<float> lpca_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  const auto p = params_of<LpcaParams>(item, map);
  const BtfcWords words = words_of(item);
  const BtfcCorners view = btfc_corners(words, p.views_word, query.view);
  const BtfcCorners light = btfc_corners(words, p.lights_word, query.light);
  std::vector<float> state;
  for (std::uint32_t k = 0; k < p.rank; ++k) {
    const vec2 scale = btfc_scale(words, p.scale_word, p.weight_scale + k);
    state.insert(state.end(), {scale.x, scale.y});
  }
  const std::uint32_t clusters = p.weight_scale / ((p.rank + 1) * p.all_channels);
  for (std::uint32_t m = 0; m < clusters; ++m) {
    for (std::uint32_t k = 0; k <= p.rank; ++k) {
      const vec4 value = lpca_reflectance(words, p, view, light, m, k);
      for (std::uint32_t c = 0; c < p.channels; ++c) state.push_back(value[static_cast<int>(c)]);
    }
  }
  return state;
}

void lpca_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                        const BtfcQuery& query, std::uint32_t width, float* out) {
  const auto p = params_of<LpcaParams>(item, map);
  const BtfcWords words = words_of(item);
  const std::uint32_t first = first_texel(item, query);
  for (std::uint32_t t = 0; t < width; ++t) {
    const std::uint32_t texel = first + t;
    const float* reflectance =
        &state[2 * p.rank + std::size_t{lpca_cluster(words, p, texel)} * (p.rank + 1) * p.channels];
    float value[4] = {0, 0, 0, 0};
    for (std::uint32_t c = 0; c < p.channels; ++c) value[c] = *reflectance++;
    for (std::uint32_t k = 0; k < p.rank; ++k) {
      const float alpha =
          state[2 * k] +
          state[2 * k + 1] * btfc_element(words, LPCA_TEXELS, 0u, p.texel_precision, texel * p.rank + k);
      for (std::uint32_t c = 0; c < p.channels; ++c) value[c] += alpha * *reflectance++;
    }
    std::memcpy(out + std::size_t{t} * p.channels, value, p.channels * sizeof(float));
  }
}

}  // namespace btfc
