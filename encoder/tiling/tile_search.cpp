// The search for a window, and the cuts that close it.
//
// A window at (x, y) of w x h texels and an overlap of m more becomes a tile as one patch of image quilting
// that meets itself (spec/models/patch.md section 4 with wrapping and k = 1): columns 0 … m-1 show, left of a
// vertical path, the texels w further right; then rows 0 … m-1 of that strip show, above a horizontal path
// that closes, the rows h further down.
#include "encoder/tiling/tile_search.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>

#include "encoder/minimum_cut.h"
#include "encoder/tiling/display_codes.h"

namespace btfc {
namespace {

constexpr std::size_t kSearchPairs = 64;  // whose errors choose the window, at most
constexpr std::size_t kLeastSearchPairs = 16;
constexpr std::size_t kFullSearchTexels = 1u << 17;  // larger sets are judged by fewer pairs
constexpr std::uint32_t kSizes = 192;                // sides looked at along each axis
constexpr std::size_t kSearchChannels = 8;           // of spectral sets
constexpr std::uint32_t kPlaces = 48;                // places of a window looked at along each axis
constexpr std::size_t kFinalists = 32;               // windows whose paths are computed

struct Window {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

// The channels and pairs that the search looks at, side by side for each texel.
class Features {
 public:
  explicit Features(const Dataset& dataset) : width_(dataset.info().width), height_(dataset.info().height) {
    const DisplayCodes display(dataset.info());
    const std::size_t pairs = dataset.info().pairs.size(), channels = dataset.info().channels.size();
    const std::size_t texels = std::size_t{width_} * height_;
    const std::size_t affordable =
        std::clamp(kSearchPairs * kFullSearchTexels / texels, kLeastSearchPairs, kSearchPairs);
    const std::size_t used = std::min(pairs, affordable), kept = std::min(channels, kSearchChannels);
    size_ = used * kept;
    values_.resize(texels * size_);
    tbb::parallel_for(std::size_t{0}, used, [&](std::size_t n) {
      // The middles of equal parts of the list of pairs.
      const auto codes = display.image(dataset, (2 * n + 1) * pairs / (2 * used));
      for (std::size_t q = 0; q < texels; ++q) {
        for (std::size_t c = 0; c < kept; ++c) {
          // 8 bits are enough to choose by.
          values_[q * size_ + n * kept + c] =
              static_cast<std::uint8_t>(codes[q * channels + c * channels / kept] >> 4);
        }
      }
    });
  }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }

  std::uint32_t difference(const TilePoint& a, const TilePoint& b) const {
    const std::uint8_t *p = at(a), *q = at(b);
    std::uint32_t sum = 0;
    for (std::size_t f = 0; f < size_; ++f) {
      const int d = p[f] - q[f];
      sum += static_cast<std::uint32_t>(d * d);
    }
    return sum;
  }

 private:
  const std::uint8_t* at(const TilePoint& t) const {
    return &values_[(std::size_t{t.y} * width_ + t.x) * size_];
  }
  std::uint32_t width_, height_;
  std::size_t size_ = 0;
  std::vector<std::uint8_t> values_;
};

// Squared errors between texels of a list of pairs of points.
using PointPairs = std::vector<std::pair<TilePoint, TilePoint>>;
using ErrorsOf = std::function<std::vector<std::uint64_t>(const PointPairs&)>;

// At most `most` whole numbers from first to last, evenly.
std::vector<std::uint32_t> evenly(std::uint32_t first, std::uint32_t last, std::uint32_t most) {
  const std::uint32_t count = std::min(last - first, most - 1) + 1;
  std::vector<std::uint32_t> out(count, first);
  for (std::uint32_t i = 1; i < count; ++i) {
    out[i] = first + static_cast<std::uint32_t>(std::uint64_t{last - first} * i / (count - 1));
  }
  return out;
}

// For each lag (a tile's side) and each place of a band of m texels: the sums along the band, from its begin,
// of the least error across it. Transposed, the same serves for rows.
class BandSums {
 public:
  BandSums(const Features& f, std::span<const std::uint32_t> lags, std::span<const std::uint32_t> places,
           std::uint32_t overlap, bool transposed)
      : places_(places.size()), length_(transposed ? f.width() : f.height()) {
    const std::uint32_t side = transposed ? f.height() : f.width();
    sums_.resize(lags.size() * places.size() * (std::size_t{length_} + 1));
    tbb::parallel_for(std::size_t{0}, lags.size(), [&](std::size_t l) {
      std::vector<std::uint32_t> row(side);
      for (std::uint32_t along = 0; along < length_; ++along) {
        for (std::uint32_t across = 0; across + lags[l] < side; ++across) {
          const TilePoint a = transposed ? TilePoint{along, across} : TilePoint{across, along};
          const TilePoint b =
              transposed ? TilePoint{along, across + lags[l]} : TilePoint{across + lags[l], along};
          row[across] = f.difference(a, b);
        }
        for (std::size_t p = 0; p < places.size(); ++p) {
          const std::uint32_t begin = places[p];
          if (begin + lags[l] + overlap > side) break;
          std::uint64_t* sum = at(l, p);
          sum[along + 1] = sum[along] + *std::min_element(row.begin() + begin, row.begin() + begin + overlap);
        }
      }
    });
  }
  // Over `count` texels along the band from `begin` on.
  std::uint64_t operator()(std::size_t lag, std::size_t place, std::uint32_t begin,
                           std::uint32_t count) const {
    const std::uint64_t* sum = at(lag, place);
    return sum[begin + count] - sum[begin];
  }

 private:
  std::uint64_t* at(std::size_t lag, std::size_t place) {
    return &sums_[(lag * places_ + place) * (std::size_t{length_} + 1)];
  }
  const std::uint64_t* at(std::size_t lag, std::size_t place) const {
    return &sums_[(lag * places_ + place) * (std::size_t{length_} + 1)];
  }
  std::size_t places_;
  std::uint32_t length_;
  std::vector<std::uint64_t> sums_;
};

// The windows with the least bounds, an error per texel of the bands' length.
std::vector<Window> finalists(const Features& f, std::span<const std::uint32_t> widths,
                              std::span<const std::uint32_t> heights, std::uint32_t m) {
  const auto xs = evenly(0, f.width() - widths.front() - m, kPlaces);
  const auto ys = evenly(0, f.height() - heights.front() - m, kPlaces);
  const BandSums columns(f, widths, xs, m, false), rows(f, heights, ys, m, true);
  struct Scored {
    double score;
    Window window;
  };
  std::vector<std::vector<Scored>> of_width(widths.size());
  tbb::parallel_for(std::size_t{0}, widths.size(), [&](std::size_t i) {
    auto& best = of_width[i];
    const auto better = [](const Scored& a, const Scored& b) { return a.score < b.score; };
    for (std::size_t j = 0; j < heights.size(); ++j) {
      const std::uint32_t w = widths[i], h = heights[j];
      for (std::size_t px = 0; px < xs.size() && xs[px] + w + m <= f.width(); ++px) {
        for (std::size_t py = 0; py < ys.size() && ys[py] + h + m <= f.height(); ++py) {
          const std::uint64_t error = columns(i, px, ys[py], h + m) + rows(j, py, xs[px], w + m);
          best.push_back({static_cast<double>(error) / (h + w + 2 * m), {xs[px], ys[py], w, h}});
          if (best.size() < 8 * kFinalists) continue;
          std::ranges::stable_sort(best, better);
          best.resize(kFinalists);
        }
      }
    }
    std::ranges::stable_sort(best, better);
    best.resize(std::min(best.size(), kFinalists));
  });
  std::vector<Scored> all;
  for (const auto& best : of_width) all.insert(all.end(), best.begin(), best.end());
  std::ranges::stable_sort(all, {}, &Scored::score);
  std::vector<Window> out;
  for (std::size_t n = 0; n < std::min(all.size(), kFinalists); ++n) out.push_back(all[n].window);
  return out;
}

struct Closed {
  TileMap tile;
  double error = 0;  // of the paths, per texel of their length
};

Closed close_window(const Window& w, std::uint32_t m, const ErrorsOf& errors_of) {
  PointPairs across;
  for (std::uint32_t v = 0; v < w.height + m; ++v) {
    for (std::uint32_t u = 0; u < m; ++u) {
      across.push_back({{w.x + u, w.y + v}, {w.x + u + w.width, w.y + v}});
    }
  }
  auto costs = errors_of(across);
  costs_of_cutting(costs, m, w.height + m);
  const Cut vertical = minimum_error_cut(costs, m, w.height + m);
  const auto strip = [&](std::uint32_t u, std::uint32_t v) {
    return TilePoint{u < m && u < vertical.path[v] ? w.x + u + w.width : w.x + u, w.y + v};
  };
  PointPairs down;
  for (std::uint32_t u = 0; u < w.width; ++u) {
    for (std::uint32_t v = 0; v < m; ++v) down.push_back({strip(u, v), strip(u, v + w.height)});
  }
  costs = errors_of(down);
  costs_of_cutting(costs, m, w.width);
  const Cut horizontal = minimum_error_closed_cut(costs, m, w.width);

  Closed out;
  out.tile.width = w.width;
  out.tile.height = w.height;
  for (std::uint32_t v = 0; v < w.height; ++v) {
    for (std::uint32_t u = 0; u < w.width; ++u) {
      out.tile.source.push_back(strip(u, v < m && v < horizontal.path[u] ? v + w.height : v));
    }
  }
  out.error = static_cast<double>(vertical.cost + horizontal.cost) / (w.width + w.height + m);
  return out;
}

// Exact sums over all pairs and channels.
std::vector<std::uint64_t> exact_errors(const Dataset& dataset, const PointPairs& points) {
  const DisplayCodes display(dataset.info());
  const std::size_t channels = dataset.info().channels.size(), width = dataset.info().width;
  const std::size_t pairs = dataset.info().pairs.size();
  // A few sums side by side; integers, so that their order does not matter.
  constexpr std::size_t kParts = 16;
  std::vector<std::vector<std::uint64_t>> parts(kParts, std::vector<std::uint64_t>(points.size()));
  tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
    for (std::size_t pair = part; pair < pairs; pair += kParts) {
      const auto codes = display.image(dataset, pair);
      for (std::size_t n = 0; n < points.size(); ++n) {
        const auto texel = [&](const TilePoint& p) { return &codes[(p.y * width + p.x) * channels]; };
        const std::uint16_t *a = texel(points[n].first), *b = texel(points[n].second);
        for (std::size_t c = 0; c < channels; ++c) {
          const int difference = a[c] - b[c];
          parts[part][n] += static_cast<std::uint64_t>(difference * difference);
        }
      }
    }
  });
  for (std::size_t part = 1; part < kParts; ++part) {
    for (std::size_t n = 0; n < points.size(); ++n) parts[0][n] += parts[part][n];
  }
  return parts[0];
}

// Another window's texels inside the first tile's border: four paths, one in a band of m texels along each
// side, from texel 1 of the tile on.
Closed inset(const TileMap& first, const TilePoint& corner, std::uint32_t m, const ErrorsOf& errors_of) {
  const std::uint32_t w = first.width, h = first.height;
  const auto own = [&](std::uint32_t u, std::uint32_t v) { return TilePoint{corner.x + u, corner.y + v}; };
  Closed out{first, 0};
  // band(a, t): a texels from the side, t along it; the path's texel is the inset's first.
  const auto path = [&](std::uint32_t count, const auto& place) {
    PointPairs points;
    for (std::uint32_t t = 0; t < count; ++t) {
      for (std::uint32_t a = 0; a < m; ++a) {
        const TilePoint p = place(a + 1, t);
        points.push_back({first.at(p.x, p.y), own(p.x, p.y)});
      }
    }
    auto costs = errors_of(points);
    costs_of_cutting(costs, m, count);
    const Cut cut = minimum_error_cut(costs, m, count);
    out.error += static_cast<double>(cut.cost) / (2 * (w + h));
    return cut.path;
  };
  const auto left = path(h, [&](auto a, auto t) { return TilePoint{a, t}; });
  const auto right = path(h, [&](auto a, auto t) { return TilePoint{w - 1 - a, t}; });
  const auto top = path(w, [&](auto a, auto t) { return TilePoint{t, a}; });
  const auto bottom = path(w, [&](auto a, auto t) { return TilePoint{t, h - 1 - a}; });
  for (std::uint32_t v = 0; v < h; ++v) {
    for (std::uint32_t u = 0; u < w; ++u) {
      const bool inside = u > left[v] && w - 1 - u > right[v] && v > top[u] && h - 1 - v > bottom[u];
      if (inside) out.tile.source[std::size_t{v} * w + u] = own(u, v);
    }
  }
  return out;
}

}  // namespace

Result<TileSet> find_tiles(const Dataset& dataset, const TileOptions& options) {
  const std::uint32_t width = dataset.info().width, height = dataset.info().height;
  if (width < 8 || height < 8) {
    return bad_argument(
        fmt::format("a tile cannot be cut from {}x{} texels, expected at least 8x8", width, height));
  }
  std::uint32_t m = std::clamp(std::min(width, height) / 16, 2u, 32u);
  std::vector<std::uint32_t> widths, heights;
  if (options.size) {
    const auto [w, h] = *options.size;
    if (w < 4 || h < 4 || w + 2 > width || h + 2 > height) {
      return bad_argument(
          fmt::format("a tile of {}x{} texels, expected 4x4 to {}x{}: two texels of the data set's "
                      "{}x{} are wanted for the overlap",
                      w, h, width - 2, height - 2, width, height));
    }
    m = std::min({m, width - w, height - h, w / 2, h / 2});
    widths = {w};
    heights = {h};
  } else {
    widths = evenly(std::max(4u, width / 4), width - m, kSizes);
    heights = evenly(std::max(4u, height / 4), height - m, kSizes);
  }

  const Features features(dataset);
  const ErrorsOf rough = [&](const PointPairs& points) {
    std::vector<std::uint64_t> out(points.size());
    std::ranges::transform(points, out.begin(),
                           [&](const auto& p) { return features.difference(p.first, p.second); });
    return out;
  };
  const ErrorsOf exact = [&](const PointPairs& points) { return exact_errors(dataset, points); };

  const std::vector<Window> windows = finalists(features, widths, heights, m);
  std::vector<double> errors(windows.size());
  tbb::parallel_for(std::size_t{0}, windows.size(),
                    [&](std::size_t n) { errors[n] = close_window(windows[n], m, rough).error; });
  const Window& best = windows[static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin())];

  TileSet out;
  out.corner = {best.x, best.y};
  out.overlap = m;
  out.tiles.push_back(close_window(best, m, exact).tile);

  // Insets, the best first; no two from places nearer than a quarter of the tile.
  if (options.count > 1) {
    const std::uint32_t band = std::min({m, best.width / 2 - 1, best.height / 2 - 1});
    std::vector<TilePoint> corners;
    for (const std::uint32_t y : evenly(0, height - best.height, kPlaces / 4)) {
      for (const std::uint32_t x : evenly(0, width - best.width, kPlaces / 4)) corners.push_back({x, y});
    }
    std::vector<double> costs(corners.size());
    tbb::parallel_for(std::size_t{0}, corners.size(),
                      [&](std::size_t n) { costs[n] = inset(out.tiles[0], corners[n], band, rough).error; });
    std::vector<std::size_t> order(corners.size());
    for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
    std::ranges::stable_sort(order, {}, [&](std::size_t n) { return costs[n]; });
    std::vector<TilePoint> taken = {out.corner};
    const auto apart = [&](const TilePoint& a, const TilePoint& b) {
      const auto far = [](std::uint32_t p, std::uint32_t q, std::uint32_t least) {
        return (p > q ? p - q : q - p) >= std::max(1u, least);
      };
      return far(a.x, b.x, best.width / 4) || far(a.y, b.y, best.height / 4);
    };
    for (const std::size_t n : order) {
      if (out.tiles.size() == options.count) break;
      const bool free = std::ranges::all_of(taken, [&](const TilePoint& t) { return apart(corners[n], t); });
      if (!free) continue;
      taken.push_back(corners[n]);
      out.tiles.push_back(inset(out.tiles[0], corners[n], band, exact).tile);
    }
    if (out.tiles.size() < options.count) {
      return bad_argument(
          fmt::format("{} tiles of {}x{} texels, expected at most {}: the data set of {}x{} has "
                      "no more windows a quarter of a tile apart",
                      options.count, best.width, best.height, out.tiles.size(), width, height));
    }
  }
  for (const TileMap& tile : out.tiles) out.seams.push_back(tile_seams(dataset, tile));
  return out;
}

}  // namespace btfc
