// Tiles: a side of kTile texels of a level's lattice, the same for every caller, so that a texel's value does
// not depend on what it was asked for with.
#include "decoder/field_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <list>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "format/models/field_collapse.h"

namespace btfc {
namespace {

constexpr std::uint32_t kTile = 256;
// What the next finer level's tile needs beyond its quarter: 2 texels, as it reaches 2 beyond itself.
constexpr std::uint32_t kApron = 2, kWide = kTile + 2 * kApron;
constexpr std::uint32_t kMostPeriod = 1u << 30;
constexpr std::size_t kCacheBytes = std::size_t{224} << 20;
// What one call of FieldCache::tiles may make and use, all levels below counted, must fit at once.
static_assert(std::size_t{4} * kFieldMostLevels * FIELD_MOST_FACTORS * kWide * kWide * sizeof(float) <=
              kCacheBytes);
// Texels whose slopes are kept, 32 MiB. A file may state a tile of 2^32 texels at no cost.
constexpr std::uint64_t kMostSlopes = std::uint64_t{1} << 22;

// What a tile holds: collapsed factors with their apron, by planes; or deviations from the mean, channels
// interleaved, without.
enum class Content : std::uint32_t { factors, deviations };

struct TileKey {
  Content content;
  std::uint32_t subspace, level, smoothest, x, y;  // x, y in tiles
  bool operator==(const TileKey&) const = default;
};

struct TileHash {
  std::size_t operator()(const TileKey& k) const {
    const uvec3 h = field_hash(
        k.x, k.y, k.subspace * 128 + k.level * 16 + k.smoothest * 2 + static_cast<uint>(k.content));
    return std::size_t{h.x} << 32 | h.y;
  }
};

struct Slope {
  float along, down;
};

class FieldCache {
 public:
  explicit FieldCache(const LoadedItem& item) : item_(item) {}

  // The tiles of some subspaces, made together where they are not there. Valid until the next call.
  void tiles(const FieldParams& p, Content content, std::span<const std::uint32_t> subspaces,
             std::uint32_t level, std::uint32_t smoothest, std::uint32_t x, std::uint32_t y,
             const float** out);
  // Of the range map at every texel of the analysed tile; empty where there is none.
  const std::vector<Slope>& slopes(const FieldParams& p);

 private:
  struct Tile {
    std::vector<float> values;
    std::list<TileKey>::iterator age;
  };
  std::vector<float> make_factors(const FieldParams& p, std::span<const std::uint32_t> subspaces,
                                  std::uint32_t level, std::uint32_t smoothest, std::uint32_t x,
                                  std::uint32_t y);
  std::vector<float> deviations(const FieldParams& p, std::uint32_t subspace, std::uint32_t smoothest,
                                const float* factors);
  void make_room(std::size_t bytes, std::size_t keep);

  const LoadedItem& item_;
  std::list<TileKey> ages_;  // the most recent first
  std::unordered_map<TileKey, Tile, TileHash> tiles_;
  std::size_t bytes_ = 0;
  std::vector<Slope> slopes_;
};

void FieldCache::make_room(std::size_t bytes, std::size_t keep) {
  while (bytes_ + bytes > kCacheBytes && ages_.size() > keep) {
    const auto oldest = tiles_.find(ages_.back());
    bytes_ -= oldest->second.values.size() * sizeof(float);
    tiles_.erase(oldest);
    ages_.pop_back();
  }
}

void FieldCache::tiles(const FieldParams& p, Content content, std::span<const std::uint32_t> subspaces,
                       std::uint32_t level, std::uint32_t smoothest, std::uint32_t x, std::uint32_t y,
                       const float** out) {
  std::vector<std::uint32_t> missing;
  const auto key = [&](std::uint32_t k) { return TileKey{content, k, level, smoothest, x, y}; };
  for (std::size_t i = 0; i < subspaces.size(); ++i) {
    const auto found = tiles_.find(key(subspaces[i]));
    if (found == tiles_.end()) {
      missing.push_back(subspaces[i]);
      continue;
    }
    ages_.splice(ages_.begin(), ages_, found->second.age);
    out[i] = found->second.values.data();
  }
  if (missing.empty()) return;
  const std::size_t d = p.all_channels, plane = std::size_t{kWide} * kWide;
  const std::vector<float> factors = make_factors(p, missing, level, smoothest, x, y);
  for (std::size_t m = 0; m < missing.size(); ++m) {
    const float* own = factors.data() + m * d * plane;
    std::vector<float> values = content == Content::factors ? std::vector<float>(own, own + d * plane)
                                                            : deviations(p, missing[m], smoothest, own);
    const std::size_t bytes = values.size() * sizeof(float);
    make_room(bytes, subspaces.size());
    // Both or neither where memory runs out: the age joins the others once the tile is there.
    std::list<TileKey> age(1, key(missing[m]));
    tiles_.emplace(key(missing[m]), Tile{std::move(values), age.begin()});
    ages_.splice(ages_.begin(), age);
    bytes_ += bytes;
  }
  for (std::size_t i = 0; i < subspaces.size(); ++i) out[i] = tiles_.at(key(subspaces[i])).values.data();
}

std::vector<float> FieldCache::make_factors(const FieldParams& p, std::span<const std::uint32_t> subspaces,
                                            std::uint32_t level, std::uint32_t smoothest, std::uint32_t x,
                                            std::uint32_t y) {
  const auto origin = [](std::uint32_t tile) { return std::int64_t{tile} * kTile - kApron; };
  const FieldWindow window{origin(x), origin(y), kWide, kWide};
  const std::size_t planes = subspaces.size() * p.all_channels;
  std::vector<float> out(planes * window.texels());
  if (level >= smoothest) field_band_values(item_, p, level, subspaces, window, out.data());
  if (level + 1 == p.levels) return out;
  const FieldWindow coarse{origin(x / 2), origin(y / 2), kWide, kWide};
  std::vector<const float*> below(subspaces.size());
  tiles(p, Content::factors, subspaces, level + 1, smoothest, x / 2, y / 2, below.data());
  for (std::size_t i = 0; i < planes; ++i) {
    field_expand_add(below[i / p.all_channels] + i % p.all_channels * coarse.texels(), coarse, window,
                     out.data() + i * window.texels());
  }
  return out;
}

std::vector<float> FieldCache::deviations(const FieldParams& p, std::uint32_t subspace,
                                          std::uint32_t smoothest, const float* factors) {
  const std::size_t row = std::size_t{kTile} * p.all_channels;
  std::vector<float> out(kTile * row);
  for (std::uint32_t y = 0; y < kTile; ++y) {
    const float* from = factors + std::size_t{y + kApron} * kWide + kApron;
    field_deviations(words_of(item_), p, subspace, smoothest, from, std::size_t{kWide} * kWide, kTile,
                     out.data() + y * row);
  }
  return out;
}

const std::vector<Slope>& FieldCache::slopes(const FieldParams& p) {
  if (!slopes_.empty() || p.range_size == 0) return slopes_;
  const BtfcWords words = words_of(item_);
  slopes_.resize(std::size_t{p.width} * p.height);
  for (std::uint32_t y = 0; y < p.height; ++y) {
    for (std::uint32_t x = 0; x < p.width; ++x) {
      const vec2 s = field_slopes(words, p, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      slopes_[std::size_t{y} * p.width + x] = {s.x, s.y};
    }
  }
  return slopes_;
}

// What all queries of one pair of directions share: those subspaces that count, first.
struct Blend {
  std::uint32_t count = 0;
  std::array<std::uint32_t, 4> subspaces;
  std::array<float, 4> weights;
  float gain;
  vec4 mean;
};

Blend blend_of(const BtfcWords& words, const FieldParams& p, const vec3& view, const vec3& light) {
  const FieldBlend from = field_blend(words, p, view, light);
  Blend b;
  b.gain = from.gain;
  b.mean = vec4(0);
  for (int i = 0; i < 4; ++i) {
    const float w = from.weight[i];
    if (w == 0) continue;
    b.subspaces[b.count] = from.subspace[i];
    b.weights[b.count++] = w;
    b.mean = b.mean + w * field_mean(words, p, from.subspace[i]);
  }
  return b;
}

using TilePointers = std::array<const float*, 4>;

struct Values {
  const LoadedItem& item;
  FieldParams p;
  BtfcWords words;
  FieldCache& cache;

  float shade(const FieldAt& at, const vec3& light) {
    if (p.range_size == 0 || (p.options & FIELD_NO_RELIEF) != 0) return 1;
    if (at.level != 0 || (p.options & FIELD_SHADOW) != 0 || std::uint64_t{p.width} * p.height > kMostSlopes)
      return field_shade(words, p, at, light);
    const Slope& s = cache.slopes(p)[std::size_t{field_tile_texel(p, at.y, 0, p.height)} * p.width +
                                     field_tile_texel(p, at.x, 0, p.width)];
    return 1.0f +
           field_number(words, p.range_word) * (field_slope_shade(vec2(s.along, s.down), light) - 1.0f);
  }

  // The finished tiles of a blend's subspaces.
  TilePointers tiles(const Blend& b, const FieldAt& at) {
    TilePointers found;
    cache.tiles(p, Content::deviations, {b.subspaces.data(), b.count}, at.level, at.smoothest, at.x / kTile,
                at.y / kTile, found.data());
    return found;
  }

  void texel(const Blend& b, const TilePointers& from, const FieldAt& at, const vec3& light, float* out) {
    const std::size_t offset =
        (std::size_t{at.y % kTile} * kTile + at.x % kTile) * p.all_channels + p.first_channel;
    const float s = shade(at, light);
    for (uint c = 0; c < p.channels; ++c) {
      float deviation = 0;
      for (std::uint32_t i = 0; i < b.count; ++i) deviation += b.weights[i] * from[i][offset + c];
      out[c] = (b.mean[static_cast<int>(c)] + b.gain * deviation) * s;
    }
  }
};

FieldAt place_of(const BtfcWords& words, const FieldParams& p, const BtfcQuery& query) {
  const FieldAt at = field_at(p, query);
  if (!field_shifts(p)) return at;
  BtfcQuery seen = query;
  seen.texel = field_parallax(words, p, query, at);
  return field_at(p, seen);
}

}  // namespace

std::shared_ptr<void> field_make_cache(const LoadedItem& item) { return std::make_shared<FieldCache>(item); }

void field_eval_queries(const LoadedItem& item, std::uint32_t map, std::span<const BtfcQuery> queries,
                        void* cache, float* out) {
  Values v{item, params_of<FieldParams>(item, map), words_of(item), *static_cast<FieldCache*>(cache)};
  // Tile by tile, so that each is made once however small the cache is.
  struct Wanted {
    std::uint64_t tile;
    std::size_t number;
    bool operator<(const Wanted& other) const {
      return std::pair(tile, number) < std::pair(other.tile, other.number);
    }
  };
  std::vector<Wanted> wanted(queries.size());
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const FieldAt at = place_of(v.words, v.p, queries[q]);
    wanted[q] = {std::uint64_t{at.level} << 60 | std::uint64_t{at.smoothest} << 56 |
                     std::uint64_t{at.y / kTile} << 28 | at.x / kTile,
                 q};
  }
  std::sort(wanted.begin(), wanted.end());
  Blend blend;
  const BtfcQuery* last = nullptr;
  TilePointers tiles{};
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const BtfcQuery& query = queries[wanted[i].number];
    const FieldAt at = place_of(v.words, v.p, query);
    const bool same_directions = last != nullptr && last->view == query.view && last->light == query.light;
    if (!same_directions) blend = blend_of(v.words, v.p, query.view, query.light);
    if (!same_directions || i == 0 || wanted[i - 1].tile != wanted[i].tile) tiles = v.tiles(blend, at);
    last = &query;
    v.texel(blend, tiles, at, query.light, out + wanted[i].number * v.p.channels);
  }
}

void field_decode_cached(const LoadedItem& item, std::uint32_t map, const BtfcQuery& query,
                         std::uint32_t width, std::uint32_t height, void* cache, float* out) {
  Values v{item, params_of<FieldParams>(item, map), words_of(item), *static_cast<FieldCache*>(cache)};
  if (field_shifts(v.p)) {
    std::vector<BtfcQuery> row(width, query);
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        row[x].texel = ivec2(query.texel.x + static_cast<int>(x), query.texel.y + static_cast<int>(y));
      }
      field_eval_queries(item, map, row, cache, out + std::size_t{y} * width * v.p.channels);
    }
    return;
  }
  const Blend blend = blend_of(v.words, v.p, query.view, query.light);
  const FieldAt first = field_at(v.p, query);
  std::vector<FieldAt> columns(width), rows(height);
  BtfcQuery at = query;
  for (std::uint32_t x = 0; x < width; ++x, at.texel.x = static_cast<int>(static_cast<uint>(at.texel.x) + 1))
    columns[x] = field_at(v.p, at);
  at = query;
  for (std::uint32_t y = 0; y < height; ++y, at.texel.y = static_cast<int>(static_cast<uint>(at.texel.y) + 1))
    rows[y] = field_at(v.p, at);
  // Runs of rows and columns that lie in one tile.
  const auto run = [](const std::vector<FieldAt>& of, std::size_t begin, uint FieldAt::*axis) {
    std::size_t end = begin + 1;
    while (end < of.size() && of[end].*axis / kTile == of[begin].*axis / kTile &&
           of[end].*axis > of[begin].*axis)
      ++end;
    return end;
  };
  for (std::size_t y0 = 0; y0 < height;) {
    const std::size_t y1 = run(rows, y0, &FieldAt::y);
    for (std::size_t x0 = 0; x0 < width;) {
      const std::size_t x1 = run(columns, x0, &FieldAt::x);
      const TilePointers tiles = v.tiles(blend, {columns[x0].x, rows[y0].y, first.level, first.smoothest});
      for (std::size_t y = y0; y < y1; ++y) {
        for (std::size_t x = x0; x < x1; ++x) {
          const FieldAt place{columns[x].x, rows[y].y, first.level, first.smoothest};
          v.texel(blend, tiles, place, query.light, out + (y * width + x) * v.p.channels);
        }
      }
      x0 = x1;
    }
    y0 = y1;
  }
}

Result<Done> field_select(LoadedItem& item, const Selection& selection) {
  if (selection.gates != 0 || selection.culling != 0)
    return bad_argument("the model has no gates and culls nothing");
  const std::uint32_t period = selection.period, options = selection.relief;
  auto p = params_of<FieldParams>(item, 0);
  std::uint64_t unit = std::uint64_t{1} << (p.levels - 1);
  if (static_cast<FieldKind>(p.kind) == FieldKind::gmrf) unit = item.words[0][p.level_word];
  if (p.range_size != 0 && (options & FIELD_NO_RELIEF) == 0)
    unit = std::lcm(unit, std::lcm(std::uint64_t{p.width}, std::uint64_t{p.height}));
  // Coordinates and distances within a longer one are no signed 32-bit numbers.
  if (period % unit != 0 || period > kMostPeriod) {
    return bad_argument(fmt::format("a period of {} texels, expected a multiple of {}, at most {}", period,
                                    unit, kMostPeriod));
  }
  for (std::vector<std::uint32_t>& raw : item.map_params) {
    std::memcpy(&p, raw.data(), sizeof p);
    p.period = period;
    p.options = options;
    std::memcpy(raw.data(), &p, sizeof p);
  }
  return Done{};
}

}  // namespace btfc
