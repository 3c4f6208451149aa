// Slices of a mixture, image by image.
#include "decoder/gm_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "decoder/model_table.h"
#include "format/models/gm_evaluate.h"
#include "format/models/gm_payload.h"
#include "shaders/models/gm.h"

namespace btfc {
namespace {

// The mean's four channels, then how many components the slice has, then its rows.
constexpr std::size_t kCountAt = 4, kRowsAt = 5;

// The mean and the mixture's share -> the value, in place.
void finish_value(const GmParams& p, const float* mean, float* value) {
  vec4 sum(0);
  for (std::uint32_t c = 0; c < p.channels; ++c) sum[static_cast<int>(c)] = mean[c] + value[c];
  sum = gm_undo_transform(sum, p.transform);
  for (std::uint32_t c = 0; c < p.channels; ++c) value[c] = sum[static_cast<int>(c)];
}

float error_of(const LoadedItem& item) { return item.culling > 0 ? item.culling : kGmError; }

// The most gates that may be selected of so many components and stored gates.
std::uint32_t most_gates(std::uint32_t components, std::uint32_t gates) {
  return gates != 0 ? gates : std::min(components, GM_MOST_GATES);
}

}  // namespace

std::uint32_t gm_most_gates(const Head& head, ByteView parm) {
  const Result<GmParm> p = read_gm_parm(head, parm);
  return p ? most_gates(p->components, p->gates) : 0;
}

Result<Done> gm_select(LoadedItem& item, const Selection& selection) {
  if (selection.period != 0 || selection.relief != 0)
    return bad_argument("the texture is not unbounded: it has no period and no relief");
  if (selection.culling != 0 &&
      !(selection.culling >= kGmLeastCulling && selection.culling <= kGmMostCulling)) {
    return bad_argument(fmt::format("a culling of {}, expected {} to {}", selection.culling, kGmLeastCulling,
                                    kGmMostCulling));
  }
  item.culling = selection.culling;
  for (std::vector<std::uint32_t>& raw : item.map_params) {
    GmParams p;
    std::memcpy(&p, raw.data(), sizeof p);
    const std::uint32_t most = most_gates(p.components, p.gates);
    if (selection.gates > most) {
      return bad_argument(fmt::format("{} gates, expected at most the {} of the file's {} components",
                                      selection.gates, most, p.components));
    }
    // As many gates as there are components are all of them, which 0 stands for.
    if (selection.gates != 0 && selection.gates < p.components) p.gates = selection.gates;
    std::memcpy(raw.data(), &p, sizeof p);
  }
  return Done{};
}

std::vector<float> gm_begin_values(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query) {
  const auto p = params_of<GmParams>(item, map);
  const GmState s = gm_begin(words_of(item), p, query);
  std::vector<float> rows;
  const GmSlice slice = gm_slice(gm_field_of_words(item.words[GM_COMPONENTS], p),
                                 gm_pair_inputs(s.directions), s.variance, s.far_limit, error_of(item), rows);
  std::vector<float> state = {s.mean.x, s.mean.y, s.mean.z, s.mean.w, std::bit_cast<float>(slice.count)};
  state.insert(state.end(), rows.begin(), rows.end());
  return state;
}

void gm_decode_values(const LoadedItem& item, std::uint32_t map, const std::vector<float>& state,
                      const BtfcQuery& query, std::uint32_t width, std::uint32_t height, float* out) {
  const auto p = params_of<GmParams>(item, map);
  GmSlice slice;
  slice.count = std::bit_cast<std::uint32_t>(state[kCountAt]);
  slice.stride = static_cast<std::uint32_t>((state.size() - kRowsAt) / kGmPairRows);
  slice.channels = p.channels;
  slice.width = static_cast<float>(p.width);
  slice.height = static_cast<float>(p.height);
  slice.wraps = p.wrap_u == 1;
  slice.rows = state.data() + kRowsAt;
  std::vector<float> xs(width), ys(height);
  for (std::uint32_t i = 0; i < width; ++i)
    xs[i] = static_cast<float>(static_cast<std::uint32_t>(query.texel.x) + i) + 0.5f;
  for (std::uint32_t j = 0; j < height; ++j)
    ys[j] = static_cast<float>(static_cast<std::uint32_t>(query.texel.y) + j) + 0.5f;
  const std::span<float> values(out, std::size_t{width} * height * p.channels);
  gm_evaluate_image(slice, xs, ys, {p.gates, error_of(item)}, values);
  for (std::size_t i = 0; i < values.size(); i += p.channels) finish_value(p, state.data(), &values[i]);
}

void gm_eval_queries(const LoadedItem& item, std::uint32_t map, std::span<const BtfcQuery> queries, void*,
                     float* out) {
  const auto p = params_of<GmParams>(item, map);
  const BtfcWords words = words_of(item);
  // Boxes of queries take texels as points: wide footprints are answered one by one.
  std::vector<std::size_t> numbers;
  std::vector<GmQuery> inputs;
  std::vector<vec4> means;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (queries[q].footprint > 1) {
      const vec4 value = gm_eval(words, p, queries[q]);
      std::memcpy(out + q * p.channels, &value, p.channels * sizeof(float));
      continue;
    }
    const GmState s = gm_begin(words, p, queries[q]);
    numbers.push_back(q);
    means.push_back(s.mean);
    inputs.push_back({static_cast<float>(btfc_wrap(queries[q].texel.x, p.width, p.wrap_u)) + 0.5f,
                      static_cast<float>(btfc_wrap(queries[q].texel.y, p.height, p.wrap_v)) + 0.5f,
                      gm_pair_inputs(s.directions)});
  }
  std::vector<float> values(inputs.size() * p.channels);
  gm_evaluate_batch(gm_field_of_words(item.words[GM_COMPONENTS], p), inputs, {p.gates, error_of(item)},
                    values);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    float* value = values.data() + i * p.channels;
    finish_value(p, &means[i].x, value);
    std::memcpy(out + numbers[i] * p.channels, value, p.channels * sizeof(float));
  }
}

}  // namespace btfc
