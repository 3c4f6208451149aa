// DIRS <-> struct, and the tables that shaders read.
#include "format/directions.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>

#include "shaders/btfc_directions.h"

namespace btfc {
namespace {

bool full_product(const Head& head) { return std::uint64_t{head.views} * head.lights == head.pairs; }

std::uint64_t table_words(std::uint64_t points) {
  return BTFC_TABLE_HEADER + 16 * points + BTFC_GRID_SIDE * BTFC_GRID_SIDE;
}

// Squared distance in the plane of the projection; below 2^52.
std::int64_t distance(const DirectionPoint& a, const DirectionPoint& b) {
  const std::int64_t x = std::int64_t{a.x} - b.x, y = std::int64_t{a.y} - b.y;
  return x * x + y * y;
}

// A side of a triangle as a line: above 0 on the inside, in units of distance.
struct Line {
  double x, y, offset;
};

std::vector<std::array<Line, 3>> lines_of(std::span<const DirectionPoint> points, const Triangulation& t) {
  std::vector<std::array<Line, 3>> lines(t.triangles.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const DirectionPoint &a = points[t.triangles[i].corners[k]],
                           &b = points[t.triangles[i].corners[(k + 1) % 3]];
      const double x = b.x - a.x, y = b.y - a.y, length = std::hypot(x, y);
      lines[i][k] = {-y / length, x / length, (y * a.x - x * a.y) / length};
    }
  }
  return lines;
}

// A triangle for the walk to start from: the one that is least far from holding (x, y).
std::uint32_t start_triangle(std::span<const std::array<Line, 3>> lines, double x, double y) {
  std::uint32_t best = 0;
  double most = -HUGE_VAL;
  for (std::uint32_t i = 0; i < lines.size(); ++i) {
    double least = HUGE_VAL;
    for (const Line& line : lines[i]) least = std::min(least, line.x * x + line.y * y + line.offset);
    if (least > most) {
      most = least;
      best = i;
    }
  }
  return best;
}

// One table, as shaders/btfc_directions.h lays it out.
void append_table(std::span<const DirectionPoint> points, std::vector<std::uint32_t>& words) {
  const Triangulation t = triangulate(points);
  const std::size_t first = words.size(), n = points.size();
  words.resize(first + table_words(n));
  std::uint32_t* w = words.data() + first;
  w[0] = static_cast<std::uint32_t>(n);
  w[1] = static_cast<std::uint32_t>(t.triangles.size());
  w[2] = static_cast<std::uint32_t>(t.border.size());
  w += BTFC_TABLE_HEADER;
  const auto unit = static_cast<float>(kPointUnit);
  for (std::size_t i = 0; i < n; ++i) {
    w[2 * i] = std::bit_cast<std::uint32_t>(static_cast<float>(points[i].x) / unit);
    w[2 * i + 1] = std::bit_cast<std::uint32_t>(static_cast<float>(points[i].y) / unit);
  }
  w += 2 * n;
  for (std::size_t i = 0; i < t.triangles.size(); ++i) {
    std::copy_n(t.triangles[i].corners.begin(), 3, w + 6 * i);
    std::copy_n(t.triangles[i].neighbours.begin(), 3, w + 6 * i + 3);
  }
  w += 12 * n;
  for (std::size_t i = 0; i < t.border.size(); ++i) std::copy_n(t.border[i].begin(), 2, w + 2 * i);
  w += 2 * n;
  if (t.triangles.empty()) return;
  const std::vector<std::array<Line, 3>> lines = lines_of(points, t);
  for (std::uint32_t cell = 0; cell < BTFC_GRID_SIDE * BTFC_GRID_SIDE; ++cell) {
    const auto centre = [](std::uint32_t c) { return ((c + 0.5) / BTFC_GRID_SIDE * 2 - 1) * kPointUnit; };
    w[cell] = start_triangle(lines, centre(cell % BTFC_GRID_SIDE), centre(cell / BTFC_GRID_SIDE));
  }
}

// Rule V3.
std::optional<Error> point_fault(const char* what, std::span<const DirectionPoint> points) {
  std::set<DirectionPoint> seen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [x, y] = points[i];
    // Each by itself first: two squares of -2^31 do not fit together.
    const auto far = [](std::int32_t v) { return v < -kPointUnit || v > kPointUnit; };
    if (far(x) || far(y) ||
        std::int64_t{x} * x + std::int64_t{y} * y > std::int64_t{kPointUnit} * kPointUnit) {
      return invalid("V3", 0,
                     fmt::format("{} {} of DIRS is ({}, {}), expected a point within 2^24 of the origin",
                                 what, i, x, y));
    }
    if (!seen.insert(points[i]).second)
      return invalid("V3", 0, fmt::format("{} {} of DIRS is there twice", what, i));
  }
  return std::nullopt;
}

// Rule V4.
std::optional<Error> pair_fault(const Head& head, std::span<const ViewLight> pairs) {
  std::vector<bool> viewed(head.views), lit(head.lights);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].view >= head.views || pairs[i].light >= head.lights ||
        (i > 0 && !(pairs[i - 1] < pairs[i]))) {
      return invalid("V4", 0,
                     fmt::format("pair {} of DIRS is ({}, {}), expected ascending pairs of {} views and {} "
                                 "lights",
                                 i, pairs[i].view, pairs[i].light, head.views, head.lights));
    }
    viewed[pairs[i].view] = true;
    lit[pairs[i].light] = true;
  }
  if (std::find(viewed.begin(), viewed.end(), false) != viewed.end() ||
      std::find(lit.begin(), lit.end(), false) != lit.end())
    return invalid("V4", 0, "DIRS has a view or a light without a pair");
  return std::nullopt;
}

}  // namespace

std::vector<ViewLight> all_pairs(std::size_t views, std::size_t lights) {
  std::vector<ViewLight> pairs;
  pairs.reserve(views * lights);
  for (std::size_t v = 0; v < views; ++v) {
    for (std::size_t l = 0; l < lights; ++l)
      pairs.push_back({static_cast<std::uint16_t>(v), static_cast<std::uint16_t>(l)});
  }
  return pairs;
}

DirectionPoint point_of(double theta, double phi) {
  const double r = std::tan(std::min(theta, std::numbers::pi / 2) / 2) * kPointUnit;
  DirectionPoint p{static_cast<std::int32_t>(std::lround(r * std::cos(phi))),
                   static_cast<std::int32_t>(std::lround(r * std::sin(phi)))};
  // On the horizon rounding may leave the disk by a unit.
  while (std::int64_t{p.x} * p.x + std::int64_t{p.y} * p.y > std::int64_t{kPointUnit} * kPointUnit) {
    std::int32_t& larger = std::abs(p.x) >= std::abs(p.y) ? p.x : p.y;
    larger += larger > 0 ? -1 : 1;
  }
  return p;
}

std::array<double, 3> unit_vector(const DirectionPoint& point) {
  const double x = static_cast<double>(point.x) / kPointUnit, y = static_cast<double>(point.y) / kPointUnit;
  const double square = x * x + y * y;
  return {2 * x / (1 + square), 2 * y / (1 + square), (1 - square) / (1 + square)};
}

ChunkSpec directions_chunk(const Head& head) {
  const std::uint64_t points = std::uint64_t{head.views} + head.lights;
  return {{kDirs, kCritical}, 8 * points + (full_product(head) ? 0 : 4 * std::uint64_t{head.pairs})};
}

Result<Done> check_direction_counts(const Head& head) {
  if (head.views > kMaxTableDirections || head.lights > kMaxTableDirections) {
    return invalid("V1", 0,
                   fmt::format("there are {} views and {} lights, expected at most {} of each", head.views,
                               head.lights, kMaxTableDirections));
  }
  const std::uint64_t product = std::uint64_t{head.views} * head.lights;
  if (head.pairs > product || head.pairs < std::max(head.views, head.lights)) {
    return invalid("V1", 0,
                   fmt::format("there are {} pairs of {} views and {} lights, expected {} to {}", head.pairs,
                               head.views, head.lights, std::max(head.views, head.lights), product));
  }
  return Done{};
}

Bytes write_directions(const Directions& d) {
  const bool list = d.pairs.size() != d.views.size() * d.lights.size();
  Bytes raw(8 * (d.views.size() + d.lights.size()) + (list ? 4 * d.pairs.size() : 0));
  std::uint8_t* to = raw.data();
  for (const auto* points : {&d.views, &d.lights}) {
    for (const DirectionPoint& p : *points) {
      store_u32(to, static_cast<std::uint32_t>(p.x));
      store_u32(to + 4, static_cast<std::uint32_t>(p.y));
      to += 8;
    }
  }
  for (std::size_t i = 0; list && i < d.pairs.size(); ++i, to += 4) {
    store_u16(to, d.pairs[i].view);
    store_u16(to + 2, d.pairs[i].light);
  }
  return raw;
}

Result<Directions> read_directions(const Head& head, ByteView raw) {
  if (raw.size() != directions_chunk(head).raw_bytes) {
    return invalid(
        "V2", 0, fmt::format("DIRS has {} bytes, expected {}", raw.size(), directions_chunk(head).raw_bytes));
  }
  Directions d;
  const std::uint8_t* from = raw.data();
  const auto points = [&](std::uint32_t count) {
    std::vector<DirectionPoint> list(count);
    for (DirectionPoint& p : list) {
      p = {static_cast<std::int32_t>(load_u32(from)), static_cast<std::int32_t>(load_u32(from + 4))};
      from += 8;
    }
    return list;
  };
  d.views = points(head.views);
  d.lights = points(head.lights);
  if (auto fault = point_fault("view", d.views)) return *fault;
  if (auto fault = point_fault("light", d.lights)) return *fault;
  if (full_product(head)) {
    d.pairs = all_pairs(head.views, head.lights);
    return d;
  }
  d.pairs.resize(head.pairs);
  for (ViewLight& pair : d.pairs) {
    pair = {load_u16(from), load_u16(from + 2)};
    from += 4;
  }
  if (auto fault = pair_fault(head, d.pairs)) return *fault;
  return d;
}

std::vector<std::uint32_t> answering_pairs(const Directions& d) {
  std::vector<std::uint32_t> pairs(d.views.size() * d.lights.size(), kNoPair);
  for (auto first = d.pairs.begin(); first != d.pairs.end();) {
    const auto end = std::find_if(first, d.pairs.end(), [&](ViewLight p) { return p.view != first->view; });
    for (std::size_t light = 0; light < d.lights.size(); ++light) {
      const auto off = [&](ViewLight p) { return distance(d.lights[light], d.lights[p.light]); };
      const auto nearest =
          std::min_element(first, end, [&](ViewLight a, ViewLight b) { return off(a) < off(b); });
      pairs[first->view * d.lights.size() + light] = static_cast<std::uint32_t>(nearest - d.pairs.begin());
    }
    first = end;
  }
  return pairs;
}

DirectionWords append_direction_words(const Directions& d, std::vector<std::uint32_t>& words) {
  DirectionWords at;
  at.views = static_cast<std::uint32_t>(words.size());
  append_table(d.views, words);
  at.lights = static_cast<std::uint32_t>(words.size());
  append_table(d.lights, words);
  if (d.pairs.size() == d.views.size() * d.lights.size()) return at;
  at.pairs = static_cast<std::uint32_t>(words.size());
  const std::vector<std::uint32_t> pairs = answering_pairs(d);
  words.insert(words.end(), pairs.begin(), pairs.end());
  return at;
}

std::uint64_t direction_words(const Head& head) {
  const std::uint64_t product = std::uint64_t{head.views} * head.lights;
  return table_words(head.views) + table_words(head.lights) + (full_product(head) ? 0 : product);
}

}  // namespace btfc
