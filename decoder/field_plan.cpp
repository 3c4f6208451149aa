// Where a level's tiles lie is the shared header's; here they are dealt to passes, or made.
#include "decoder/field_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "format/checked.h"
#include "format/models/field_collapse.h"
#include "shaders/models/field_prepare.h"

namespace btfc {
namespace {

constexpr std::uint64_t kMostGroups = 65535;  // an axis of a dispatch, Vulkan's guaranteed minimum
constexpr std::uint32_t kCollapseSide = 8;    // texels a workgroup of btfc_field_collapse.comp
// Iterations of all loops of an invocation together. Mesa's llvmpipe silently leaves loops after 65535; and
// no dispatch takes long, which watchdogs would not suffer.
constexpr std::uint64_t kMostIterations = 50000;
// Floats of a batch of subspaces that are made here at once.
constexpr std::size_t kBatchFloats = std::size_t{1} << 22;

// No unit takes more scratch than a pass may have.
static_assert(std::uint64_t{FIELD_TILE_MOST + 2 * kFieldMostMargin} * (FIELD_TILE_MOST + kFieldMostMargin) *
                  FIELD_MOST_FACTORS * sizeof(float) <=
              kFieldMostScratchBytes);

CheckedSize atlas_bytes(const FieldParams& p) {
  CheckedSize bytes = 0;
  for (std::uint32_t l = p.least_level; l < p.levels; ++l) {
    const auto texels = [&](std::uint32_t at, std::uint32_t size) {
      if (p.period != 0) return std::uint64_t{p.period >> l};
      // As field_atlas_axis, of sizes that it need not hold.
      return ((at % (1u << l) + std::uint64_t{size} - 1) >> l) + 1 + 2 * FIELD_ATLAS_APRON;
    };
    bytes = bytes + CheckedSize(texels(p.atlas_x, p.atlas_width)) * texels(p.atlas_y, p.atlas_height) *
                        p.clusters * p.all_channels * sizeof(float);
  }
  return bytes;
}

// Steps of the recursion that an invocation may take in one dispatch.
std::uint32_t steps_at_once(const BtfcWords& words, const FieldParams& p, std::uint32_t level) {
  const std::uint64_t factors = field_unit_factors(p);
  const std::uint32_t masks = field_level(words, p, level, 3);
  std::uint64_t neighbours = 0;
  for (std::uint32_t f = 0; f < p.all_channels / factors; ++f)
    neighbours = std::max<std::uint64_t>(neighbours, field_mask_size(words, masks + 2 * f));
  // Of a step: over factors, their noises, the mask's words, neighbours, and factors of neighbours.
  const std::uint64_t iterations = 4 + factors * (8 + factors + neighbours * (2 + factors));
  return static_cast<std::uint32_t>(std::max<std::uint64_t>(1, kMostIterations / iterations));
}

// Units of a level in dispatches of as many as scratch and grids allow.
void append_level(const BtfcWords& words, const FieldParams& p, std::uint32_t level, GpuPrepare& plan) {
  const FieldAtlasLevel a = field_atlas_level(p, level);
  const FieldTiles t = field_tiles(a);
  const std::uint64_t factors = field_unit_factors(p), unit_words = field_unit_words(words, p, a, level);
  const std::uint64_t units = std::uint64_t{t.across} * t.down * p.clusters * p.all_channels / factors;
  std::uint64_t most = kMostGroups / factors;
  if (unit_words > 0)
    most = std::min<std::uint64_t>(most, kFieldMostScratchBytes / sizeof(float) / unit_words);
  // The first unit is as large as any.
  const bool recursion = unit_words > 0;
  const std::uint32_t steps = recursion ? field_walk_steps(field_unit(words, p, a, level, 0)) : 0;
  const std::uint32_t most_steps = recursion ? steps_at_once(words, p, level) : 1;
  for (std::uint64_t first = 0; first < units; first += most) {
    const auto count = static_cast<std::uint32_t>(std::min(most, units - first));
    const auto unit = static_cast<std::uint32_t>(first);
    plan.scratch_bytes = std::max(plan.scratch_bytes, count * unit_words * sizeof(float));
    for (std::uint32_t step = 0; step < steps; step += most_steps) {
      plan.passes.push_back({"btfc_field_recursion.comp",
                             {count, 1, 1},
                             {level, unit, step, std::min(most_steps, steps - step)}});
    }
    const auto groups = [](std::uint32_t texels) { return (texels + kCollapseSide - 1) / kCollapseSide; };
    plan.passes.push_back({"btfc_field_collapse.comp",
                           {groups(t.width), groups(t.height), count * static_cast<std::uint32_t>(factors)},
                           {level, unit, 0, 0}});
  }
}

// A level's part in coordinates that do not wrap, so that halves of them are those of the coarser level.
FieldWindow unwrapped(const FieldParams& p, std::uint32_t level) {
  const FieldAtlasLevel a = field_atlas_level(p, level);
  if (p.period != 0) return {0, 0, a.width, a.height};
  const auto first = [&](std::uint32_t at) {
    return (std::int64_t{static_cast<std::int32_t>(at)} >> level) - FIELD_ATLAS_APRON;
  };
  return {first(p.atlas_x), first(p.atlas_y), a.width, a.height};
}

// A level alone: out[plane * texels + texel] of some subspaces, tile by tile.
void make_bands(const LoadedItem& item, const FieldParams& p, std::uint32_t level,
                std::span<const std::uint32_t> subspaces, float* out) {
  const FieldWindow whole = unwrapped(p, level);
  const FieldTiles t = field_tiles(field_atlas_level(p, level));
  const std::size_t planes = subspaces.size() * p.all_channels;
  std::vector<float> values;
  for (std::uint32_t y = 0; y < whole.height; y += t.height) {
    for (std::uint32_t x = 0; x < whole.width; x += t.width) {
      const FieldWindow tile{whole.x + x, whole.y + y, std::min(t.width, whole.width - x),
                             std::min(t.height, whole.height - y)};
      values.resize(planes * tile.texels());
      field_band_values(item, p, level, subspaces, tile, values.data());
      for (std::size_t row = 0; row < planes * tile.height; ++row) {
        const std::size_t plane = row / tile.height, to_y = y + row % tile.height;
        std::copy_n(&values[row * tile.width], tile.width,
                    out + (plane * whole.height + to_y) * whole.width + x);
      }
    }
  }
}

// A period's plane with what expanding reaches beyond its sides.
std::vector<float> wrapped_plane(const float* plane, std::uint32_t side, const FieldWindow& window) {
  std::vector<float> out;
  out.reserve(window.texels());
  const auto place = [&](std::int64_t first, std::uint32_t at) {
    return static_cast<std::size_t>((first + at + side) % side);
  };
  for (std::uint32_t y = 0; y < window.height; ++y) {
    for (std::uint32_t x = 0; x < window.width; ++x)
      out.push_back(plane[place(window.y, y) * side + place(window.x, x)]);
  }
  return out;
}

}  // namespace

Result<GpuPrepare> field_prepare(const LoadedItem& item, const GpuWindow& window) {
  GpuPrepare plan;
  plan.map_params = item.map_params;
  if (window.width == 0 && window.height == 0) return plan;
  if (window.width == 0 || window.height == 0) {
    return bad_argument(fmt::format("a window of {} x {} texels, expected both sides above 0, or none",
                                    window.width, window.height));
  }
  auto p = params_of<FieldParams>(item, 0);
  p.atlas_x = p.period != 0 ? 0 : static_cast<std::uint32_t>(window.x);
  p.atlas_y = p.period != 0 ? 0 : static_cast<std::uint32_t>(window.y);
  p.atlas_width = p.period != 0 ? p.period : window.width;
  p.atlas_height = p.period != 0 ? p.period : window.height;
  const std::uint64_t bytes = atlas_bytes(p).saturated();
  if (bytes > kFieldMostAtlasBytes) {
    return Error{
        Status::limit,
        fmt::format("the prepared window of {} x {} texels{} of {} subspaces of {} factors would take "
                    "{} bytes, expected at most {}",
                    p.atlas_width, p.atlas_height, p.period != 0 ? ", the period," : "", p.clusters,
                    p.all_channels, bytes, kFieldMostAtlasBytes),
        "", 0};
  }
  for (std::vector<std::uint32_t>& raw : plan.map_params) {
    FieldParams own;
    std::memcpy(&own, raw.data(), sizeof own);
    own.atlas_x = p.atlas_x;
    own.atlas_y = p.atlas_y;
    own.atlas_width = p.atlas_width;
    own.atlas_height = p.atlas_height;
    std::memcpy(raw.data(), &own, sizeof own);
  }
  plan.made_words[2] = bytes / sizeof(float);
  for (std::uint32_t l = p.levels; l-- > p.least_level;) append_level(words_of(item), p, l, plan);
  return plan;
}

std::vector<std::uint32_t> field_atlas(const LoadedItem& item, const FieldParams& p) {
  if (p.atlas_width == 0) return {};
  std::vector<std::uint32_t> atlas(field_atlas_level(p, p.levels).first);
  const std::size_t d = p.all_channels;
  const std::size_t largest = unwrapped(p, p.least_level).texels() * d;
  const auto most =
      static_cast<std::uint32_t>(std::clamp<std::size_t>(kBatchFloats / largest, 1, std::size_t{p.clusters}));
  for (std::uint32_t begin = 0; begin < p.clusters; begin += most) {
    std::vector<std::uint32_t> subspaces(std::min(most, p.clusters - begin));
    std::iota(subspaces.begin(), subspaces.end(), begin);
    const std::size_t planes = subspaces.size() * d;
    std::vector<float> coarse;
    for (std::uint32_t l = p.levels; l-- > p.least_level;) {
      const FieldWindow own = unwrapped(p, l);
      std::vector<float> values(planes * own.texels());
      make_bands(item, p, l, subspaces, values.data());
      for (std::size_t i = 0; i < planes && l + 1 < p.levels; ++i) {
        FieldWindow from = unwrapped(p, l + 1);
        const float* plane = coarse.data() + i * from.texels();
        std::vector<float> wrapped;
        if (p.period != 0) {
          const std::uint32_t side = from.width;
          from = field_coarse_window(own);
          wrapped = wrapped_plane(plane, side, from);
          plane = wrapped.data();
        }
        field_expand_add(plane, from, own, values.data() + i * own.texels());
      }
      std::memcpy(&atlas[field_atlas_level(p, l).first + begin * d * own.texels()], values.data(),
                  values.size() * sizeof(float));
      coarse = std::move(values);
    }
  }
  return atlas;
}

}  // namespace btfc
