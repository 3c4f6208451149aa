// Values, inputs, groups of pairs.
#include "encoder/models/gm_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "shaders/btfc_half.h"

namespace btfc {
namespace {

// Directions a group: about this many, so that a group's box is small beside the spreads.
constexpr std::size_t kDirectionsPerGroup = 7;

// Bytes of codes that are held in memory.
constexpr std::uint64_t kMostNear = std::uint64_t{512} << 20;

vec3 unit(const Direction& d) {
  const Vector3 v = unit_vector(d);
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

float code_value(SampleType type, std::uint32_t code) {
  if (type == SampleType::unorm8) return static_cast<float>(code) / 255.0f;
  if (type == SampleType::unorm16) return static_cast<float>(code) / 65535.0f;
  const float value = btfc_half_to_float(code);
  return std::isfinite(value) ? value : 0.0f;
}

// Which group each direction belongs to: middles as far from each other as can be, one after another.
std::vector<std::uint32_t> group_directions(const std::vector<Direction>& directions) {
  const std::size_t count = (directions.size() + kDirectionsPerGroup - 1) / kDirectionsPerGroup;
  std::vector<std::uint32_t> group(directions.size(), 0);
  std::vector<double> nearest(directions.size(), 10.0);
  std::size_t middle = 0;
  for (std::size_t g = 0; g < count; ++g) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double angle = angle_between(directions[i], directions[middle]);
      if (angle < nearest[i]) {
        nearest[i] = angle;
        group[i] = static_cast<std::uint32_t>(g);
      }
    }
    middle = static_cast<std::size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  return group;
}

void bound(const float* value, float* low, float* high) {
  for (int n = 0; n < 4; ++n) {
    low[n] = std::min(low[n], value[n]);
    high[n] = std::max(high[n], value[n]);
  }
}

GmBox box_of(const std::vector<GmPairInputs>& pairs, const std::vector<std::uint32_t>& members) {
  GmPairInputs low = pairs[members[0]], high = low;
  for (const std::uint32_t p : members) {
    bound(pairs[p].angle, low.angle, high.angle);
    bound(pairs[p].slope, low.slope, high.slope);
  }
  GmBox box;
  gm_set_directions(low, high, box);
  return box;
}

}  // namespace

GmSamples gm_samples(const Dataset& dataset, ValueTransform transform, GmOnion onion) {
  const DatasetInfo& info = dataset.info();
  GmSamples out;
  out.dataset = &dataset;
  out.width = info.width;
  out.height = info.height;
  out.channels = info.channel_count();
  out.wraps = info.wraps;
  out.values.resize(info.type == SampleType::unorm8 ? 256 : 65536);
  for (std::uint32_t code = 0; code < out.values.size(); ++code) {
    const float value = code_value(info.type, code);
    out.values[code] = transform == ValueTransform::log ? std::log1p(std::max(value, 0.0f)) : value;
  }
  if (info.type == SampleType::float16) {
    out.low = -1e30f;
    out.high = 1e30f;
  }
  for (const DirectionPair& pair : info.pairs) {
    out.pairs.push_back(gm_pair_inputs(gm_directions(
        unit(info.views[pair.view]), unit(info.lights[pair.light]), static_cast<std::uint32_t>(onion))));
  }
  double sum = 0;
  for (std::size_t pair = 0; pair < info.pairs.size(); ++pair) {
    out.weights.push_back(static_cast<float>(info.weight(pair)));
    if (!info.weights.empty()) out.cumulative_weights.push_back(sum += info.weights[pair]);
  }
  const auto view_group = group_directions(info.views), light_group = group_directions(info.lights);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> groups;
  for (std::uint32_t p = 0; p < info.pairs.size(); ++p) {
    groups[{view_group[info.pairs[p].view], light_group[info.pairs[p].light]}].push_back(p);
  }
  if (info.type == SampleType::unorm8 && out.count() * out.channels <= kMostNear) {
    out.near.resize(out.count() * out.channels);
    tbb::parallel_for(std::size_t{0}, info.pairs.size(), [&](std::size_t pair) {
      std::vector<std::uint16_t> codes(info.image_samples());
      dataset.read_image(pair, codes);
      std::transform(codes.begin(), codes.end(),
                     out.near.begin() + static_cast<std::ptrdiff_t>(pair * codes.size()),
                     [](std::uint16_t code) { return static_cast<std::uint8_t>(code); });
    });
  }
  for (const auto& [key, members] : groups) out.groups.push_back({box_of(out.pairs, members), members});
  return out;
}

std::uint32_t GmSamples::draw_pair(SplitMix64& random) const {
  if (cumulative_weights.empty()) return random.below(pairs.size());
  const double at = random.uniform() * cumulative_weights.back();
  const auto found = std::upper_bound(cumulative_weights.begin(), cumulative_weights.end() - 1, at);
  return static_cast<std::uint32_t>(found - cumulative_weights.begin());
}

void GmSamples::rectangle(std::size_t pair, std::uint32_t x, std::uint32_t y, std::uint32_t columns,
                          std::uint32_t rows, float* out) const {
  const float* less = mean.data() + pair * channels;
  const std::size_t row = std::size_t{columns} * channels;
  for (std::uint32_t j = 0; j < rows; ++j, out += row) {
    if (!near.empty()) {
      const std::uint8_t* codes = near.data() + ((pair * height + y + j) * width + x) * channels;
      for (std::size_t i = 0; i < row; ++i) out[i] = values[codes[i]];
    } else {
      for (std::size_t i = 0; i < row; ++i) {
        out[i] = value(pair, x + static_cast<std::uint32_t>(i) / channels, y + j,
                       static_cast<std::uint32_t>(i) % channels);
      }
    }
    for (std::size_t i = 0; i < row; i += channels) {
      for (std::size_t c = 0; c < channels; ++c) out[i + c] -= less[c];
    }
  }
}

std::array<double, kGmInputs> gm_spread_floors(const GmSamples& samples) {
  constexpr double kLeast = 0.3, kLeastAngle = 0.01;
  const DatasetInfo& info = samples.dataset->info();
  const double view = std::max(kLeastAngle, kLeast * typical_step(info.views)),
               light = std::max(kLeastAngle, kLeast * typical_step(info.lights));
  return {kLeast, kLeast, view, view, light, light};
}

std::vector<float> gm_mean_table(const GmSamples& samples) {
  std::vector<float> table(samples.pairs.size() * samples.channels);
  tbb::parallel_for(std::size_t{0}, samples.pairs.size(), [&](std::size_t pair) {
    std::vector<std::uint16_t> codes(samples.dataset->info().image_samples());
    samples.dataset->read_image(pair, codes);
    std::vector<double> sums(samples.channels);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      sums[i % samples.channels] += static_cast<double>(samples.values[codes[i]]);
    }
    for (std::size_t c = 0; c < samples.channels; ++c) {
      table[pair * samples.channels + c] =
          static_cast<float>(sums[c] / (double{1} * samples.width * samples.height));
    }
  });
  return table;
}

}  // namespace btfc
