// A sweep that triangulates, then flips until every side is Delaunay.
#include "format/triangulation.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace btfc {
namespace {

__extension__ typedef __int128 Int128;

// Twice the signed area: above 0 where a, b, c turn left.
std::int64_t turn(const DirectionPoint& a, const DirectionPoint& b, const DirectionPoint& c) {
  const std::int64_t bx = std::int64_t{b.x} - a.x, by = std::int64_t{b.y} - a.y;
  const std::int64_t cx = std::int64_t{c.x} - a.x, cy = std::int64_t{c.y} - a.y;
  return bx * cy - by * cx;
}

// Above 0 where d lies inside the circle through a, b, c (counter-clockwise), 0 on it. At most 2^110.
Int128 inside_circle(const DirectionPoint& a, const DirectionPoint& b, const DirectionPoint& c,
                     const DirectionPoint& d) {
  const auto row = [&](const DirectionPoint& p) {
    const std::int64_t x = std::int64_t{p.x} - d.x, y = std::int64_t{p.y} - d.y;
    return std::array<std::int64_t, 3>{x, y, x * x + y * y};
  };
  const auto p = row(a), q = row(b), r = row(c);
  return Int128{p[2]} * (q[0] * r[1] - q[1] * r[0]) - Int128{q[2]} * (p[0] * r[1] - p[1] * r[0]) +
         Int128{r[2]} * (p[0] * q[1] - p[1] * q[0]);
}

using Corners = std::array<std::uint32_t, 3>;

// Points in lexicographic order, each joined to the sides of the hull so far that it sees.
std::vector<Corners> sweep(std::span<const DirectionPoint> points, std::span<const std::uint32_t> order,
                           std::size_t line) {
  // The first `line` points of the order lie on one line, the next one does not.
  std::vector<Corners> triangles;
  std::vector<std::uint32_t> hull(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(line));
  const std::uint32_t apex = order[line];
  if (turn(points[hull.front()], points[hull.back()], points[apex]) < 0)
    std::reverse(hull.begin(), hull.end());
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) triangles.push_back({hull[i], hull[i + 1], apex});
  hull.push_back(apex);
  for (std::size_t n = line + 1; n < order.size(); ++n) {
    const std::uint32_t p = order[n];
    std::vector<bool> seen(hull.size());
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const std::uint32_t a = hull[i], b = hull[(i + 1) % hull.size()];
      seen[i] = turn(points[a], points[b], points[p]) < 0;
      if (seen[i]) triangles.push_back({b, a, p});
    }
    // The seen sides are one run; p takes the place of the corners inside it.
    std::vector<std::uint32_t> next;
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const bool before = seen[(i + hull.size() - 1) % hull.size()];
      if (!before || !seen[i]) next.push_back(hull[i]);
      if (seen[i] && !before) next.push_back(p);
    }
    hull = std::move(next);
  }
  return triangles;
}

// Index of the corner that is not on the side towards a neighbour.
std::size_t corner_towards(const Triangulation::Triangle& t, std::uint32_t neighbour) {
  return static_cast<std::size_t>(std::find(t.neighbours.begin(), t.neighbours.end(), neighbour) -
                                  t.neighbours.begin());
}

void join_neighbours(Triangulation& result) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> sides;
  for (std::uint32_t t = 0; t < result.triangles.size(); ++t) {
    const Corners& c = result.triangles[t].corners;
    for (std::size_t i = 0; i < 3; ++i) sides[{c[(i + 1) % 3], c[(i + 2) % 3]}] = t;
  }
  for (auto& t : result.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto other = sides.find({t.corners[(i + 2) % 3], t.corners[(i + 1) % 3]});
      t.neighbours[i] = other == sides.end() ? kNoTriangle : other->second;
    }
  }
}

// Whether the side that t and u share should be the other diagonal of their four points.
bool should_flip(std::span<const DirectionPoint> points, const Triangulation::Triangle& t, std::size_t i,
                 std::uint32_t opposite) {
  const auto& [a, b, c] = t.corners;
  const Int128 inside = inside_circle(points[a], points[b], points[c], points[opposite]);
  if (inside != 0) return inside > 0;
  return std::min(t.corners[i], opposite) < std::min(t.corners[(i + 1) % 3], t.corners[(i + 2) % 3]);
}

// Triangles t and u = its neighbour opposite corner i get the other diagonal.
void flip(Triangulation& r, std::uint32_t t, std::size_t i) {
  const std::uint32_t u = r.triangles[t].neighbours[i];
  Triangulation::Triangle &a = r.triangles[t], &b = r.triangles[u];
  const std::size_t j = corner_towards(b, t);
  const std::uint32_t p = a.corners[i], q = a.corners[(i + 1) % 3], s = a.corners[(i + 2) % 3],
                      o = b.corners[j];
  // Around q and s: which triangles lie beyond the four outer sides.
  const std::uint32_t beyond_sp = a.neighbours[(i + 1) % 3], beyond_pq = a.neighbours[(i + 2) % 3];
  const std::uint32_t beyond_qo = b.neighbours[(j + 1) % 3], beyond_os = b.neighbours[(j + 2) % 3];
  a = {{p, q, o}, {beyond_qo, u, beyond_pq}};
  b = {{p, o, s}, {beyond_os, beyond_sp, t}};
  const auto replace = [&](std::uint32_t of, std::uint32_t from, std::uint32_t to) {
    if (of != kNoTriangle) r.triangles[of].neighbours[corner_towards(r.triangles[of], from)] = to;
  };
  replace(beyond_qo, u, t);
  replace(beyond_sp, t, u);
}

void make_delaunay(std::span<const DirectionPoint> points, Triangulation& r) {
  std::vector<std::uint32_t> open(r.triangles.size());
  std::iota(open.begin(), open.end(), 0u);
  while (!open.empty()) {
    const std::uint32_t t = open.back();
    open.pop_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t u = r.triangles[t].neighbours[i];
      if (u == kNoTriangle) continue;
      const std::uint32_t opposite = r.triangles[u].corners[corner_towards(r.triangles[u], t)];
      if (!should_flip(points, r.triangles[t], i, opposite)) continue;
      flip(r, t, i);
      open.push_back(t);
      open.push_back(u);
      break;
    }
  }
}

std::int64_t square_distance(const DirectionPoint& a, const DirectionPoint& b) {
  const std::int64_t x = std::int64_t{b.x} - a.x, y = std::int64_t{b.y} - a.y;
  return x * x + y * y;
}

// Whether p lies so near to the line through a and b that rounding of coordinates may have put it there.
bool thin(const DirectionPoint& a, const DirectionPoint& b, const DirectionPoint& p) {
  constexpr std::int64_t kThin = 64;  // units
  return std::abs(turn(a, b, p)) <=
         kThin * std::max(std::abs(std::int64_t{b.x} - a.x), std::abs(std::int64_t{b.y} - a.y));
}

// The first of the points that are farthest from one.
std::uint32_t farthest(std::span<const DirectionPoint> points, std::uint32_t from) {
  std::uint32_t best = 0;
  for (std::uint32_t i = 1; i < points.size(); ++i) {
    if (square_distance(points[from], points[i]) > square_distance(points[from], points[best])) best = i;
  }
  return best;
}

// The border of points on one line, or of one point; empty where they are not on a line.
std::vector<std::array<std::uint32_t, 2>> chain(std::span<const DirectionPoint> points) {
  if (points.size() == 1) return {{0, 0}};
  const std::uint32_t a = farthest(points, 0), b = farthest(points, a);
  if (!std::all_of(points.begin(), points.end(),
                   [&](const DirectionPoint& p) { return thin(points[a], points[b], p); }))
    return {};
  const auto along = [&](std::uint32_t i) {
    return (std::int64_t{points[i].x} - points[a].x) * (std::int64_t{points[b].x} - points[a].x) +
           (std::int64_t{points[i].y} - points[a].y) * (std::int64_t{points[b].y} - points[a].y);
  };
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t i, std::uint32_t j) { return along(i) < along(j); });
  std::vector<std::array<std::uint32_t, 2>> sides;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) sides.push_back({order[i], order[i + 1]});
  return sides;
}

// Takes thin triangles off the border, whose third corner lies on their outer side but for rounding. Where
// that would leave nothing, all stay.
void peel(std::span<const DirectionPoint> points, Triangulation& r) {
  const std::vector<Triangulation::Triangle> all = r.triangles;
  std::vector<bool> gone(r.triangles.size());
  for (bool found = true; found;) {
    found = false;
    for (std::uint32_t t = 0; t < r.triangles.size(); ++t) {
      const auto& [corners, neighbours] = r.triangles[t];
      for (std::size_t i = 0; i < 3 && !gone[t]; ++i) {
        gone[t] = neighbours[i] == kNoTriangle &&
                  thin(points[corners[(i + 1) % 3]], points[corners[(i + 2) % 3]], points[corners[i]]);
      }
      if (!gone[t] || corners == Corners{0, 0, 0}) continue;
      for (const std::uint32_t n : neighbours) {
        if (n != kNoTriangle) r.triangles[n].neighbours[corner_towards(r.triangles[n], t)] = kNoTriangle;
      }
      r.triangles[t] = {{0, 0, 0}, {kNoTriangle, kNoTriangle, kNoTriangle}};
      found = true;
    }
  }
  std::vector<std::uint32_t> number(r.triangles.size(), kNoTriangle);
  std::vector<Triangulation::Triangle> kept;
  for (std::uint32_t t = 0; t < r.triangles.size(); ++t) {
    if (gone[t]) continue;
    number[t] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(r.triangles[t]);
  }
  for (auto& t : kept) {
    for (std::uint32_t& n : t.neighbours) n = n == kNoTriangle ? n : number[n];
  }
  r.triangles = kept.empty() ? all : std::move(kept);
}

}  // namespace

Triangulation triangulate(std::span<const DirectionPoint> points) {
  Triangulation result;
  result.border = chain(points);
  if (!result.border.empty()) return result;
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return points[a] < points[b]; });
  std::size_t line = 2;  // not all points lie on one line
  while (turn(points[order[0]], points[order[1]], points[order[line]]) == 0) ++line;
  for (const Corners& corners : sweep(points, order, line))
    result.triangles.push_back({corners, {kNoTriangle, kNoTriangle, kNoTriangle}});
  join_neighbours(result);
  make_delaunay(points, result);
  peel(points, result);
  for (const auto& t : result.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (t.neighbours[i] == kNoTriangle)
        result.border.push_back({t.corners[(i + 1) % 3], t.corners[(i + 2) % 3]});
    }
  }
  return result;
}

}  // namespace btfc
