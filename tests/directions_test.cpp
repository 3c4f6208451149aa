// Directions: triangulation, corners, pairs that are missing, and the rules of DIRS.
#include "format/directions.h"

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "encoder/dataset/direction.h"
#include "shaders/btfc_directions.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

using Point = DirectionPoint;
__extension__ typedef __int128 Int128;

std::vector<Point> points_of(const std::vector<Direction>& directions) {
  std::vector<Point> points;
  for (const Direction& d : directions) points.push_back(point_of(d.theta, d.phi));
  return points;
}

std::int64_t area(const Point& a, const Point& b, const Point& c) {
  return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
         (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

// Whether d lies inside (above 0) the circle of a, b, c: by lifting to a paraboloid, another way than the
// library's.
int circle_side(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto lift = [](const Point& p) { return Int128{p.x} * p.x + Int128{p.y} * p.y; };
  const Int128 value =
      lift(a) * area(b, c, d) - lift(b) * area(a, c, d) + lift(c) * area(a, b, d) - lift(d) * area(a, b, c);
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

// Every property that defines the triangulation, checked by brute force.
void check_triangulation(const std::vector<Point>& points) {
  const Triangulation t = triangulate(points);
  Int128 covered = 0;
  for (const auto& triangle : t.triangles) {
    const auto& [i, j, k] = triangle.corners;
    ASSERT_GT(area(points[i], points[j], points[k]), 0);
    covered += area(points[i], points[j], points[k]);
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      if (p == i || p == j || p == k) continue;
      const int side = circle_side(points[i], points[j], points[k], points[p]);
      ASSERT_LE(side, 0) << "point " << p << " lies in the circle of " << i << " " << j << " " << k;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t other = triangle.neighbours[c];
      if (other == kNoTriangle) continue;
      const auto& back = t.triangles[other];
      const auto at =
          static_cast<std::size_t>(std::find(back.neighbours.begin(), back.neighbours.end(),
                                             static_cast<std::uint32_t>(&triangle - t.triangles.data())) -
                                   back.neighbours.begin());
      ASSERT_LT(at, 3u);
      const std::uint32_t a = triangle.corners[(c + 1) % 3], b = triangle.corners[(c + 2) % 3];
      const std::uint32_t own = triangle.corners[c], far = back.corners[at];
      if (circle_side(points[i], points[j], points[k], points[far]) == 0) {
        EXPECT_LT(std::min(a, b), std::min(own, far)) << "the diagonal of a circle's four lacks the lowest";
      }
    }
  }
  // The hull's area, from its border.
  Int128 hull = 0;
  std::set<std::uint32_t> used;
  for (const auto& [a, b] : t.border) {
    hull += Int128{points[a].x} * points[b].y - Int128{points[b].x} * points[a].y;
    used.insert(a);
    used.insert(b);
    for (const Point& p : points) EXPECT_GE(area(points[a], points[b], p), 0);
  }
  for (const auto& triangle : t.triangles) used.insert(triangle.corners.begin(), triangle.corners.end());
  EXPECT_EQ(used.size(), points.size());
  EXPECT_TRUE(covered == hull);
  EXPECT_EQ(t.triangles.size(), 2 * points.size() - 2 - t.border.size());
}

TEST(Triangulation, OfGridsRingsAndRandomPoints) {
  check_triangulation(points_of(ubo2003_directions()));
  check_triangulation(points_of(ubo2014_directions()));
  std::vector<Point> grid;
  for (int i = 0; i < 49; ++i) grid.push_back({(i * 5 % 7 - 3) * 100000, (i / 7 - 3) * 100000});
  check_triangulation(grid);
  std::mt19937 random(3);
  for (int round = 0; round < 60; ++round) {
    std::set<Point> points;
    const int range = round % 3 == 0 ? 3 : round % 3 == 1 ? 40 : 1000;
    constexpr int kSpacing = 8192;  // no triangle is thin
    const std::size_t count = 3 + random() % (round % 3 == 0 ? 12 : 40);
    while (points.size() < count) {
      points.insert({kSpacing * (static_cast<std::int32_t>(random() % (2u * range + 1)) - range),
                     kSpacing * (static_cast<std::int32_t>(random() % (2u * range + 1)) - range)});
    }
    std::vector<Point> list(points.begin(), points.end());
    std::shuffle(list.begin(), list.end(), random);
    bool line = true;
    for (const Point& p : list) line = line && area(list[0], list[1], p) == 0;
    if (!line) check_triangulation(list);
  }
}

TEST(Triangulation, OfPointsOnALineAndOfOne) {
  const Triangulation line = triangulate(std::vector<Point>{{30, 30}, {-10, -10}, {0, 0}, {20, 20}});
  EXPECT_TRUE(line.triangles.empty());
  ASSERT_EQ(line.border.size(), 3u);
  EXPECT_EQ(line.border[0], (std::array<std::uint32_t, 2>{1, 2}));
  EXPECT_EQ(line.border[2], (std::array<std::uint32_t, 2>{3, 0}));
  const Triangulation one = triangulate(std::vector<Point>{{5, 5}});
  ASSERT_EQ(one.border.size(), 1u);
  EXPECT_EQ(one.border[0], (std::array<std::uint32_t, 2>{0, 0}));
}

// The tables of a set of directions, lights along the normal.
struct Table {
  std::vector<std::uint32_t> words;
  DirectionWords at;
  std::vector<Point> points;

  explicit Table(const std::vector<Direction>& directions) : points(points_of(directions)) {
    Directions d{points, {{0, 0}}, all_pairs(points.size(), 1)};
    at = append_direction_words(d, words);
  }
  BtfcCorners corners(const vec3& d) const { return btfc_corners({{words.data()}}, at.views, d); }
};

vec3 vector_of(const Direction& d) {
  const Vector3 v = unit_vector(d);
  return vec3(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
}

const std::vector<std::vector<Direction>>& direction_sets() {
  static const std::vector<std::vector<Direction>> sets = [] {
    std::vector<std::vector<Direction>> all = {ubo2003_directions(), ubo2014_directions(), rings(0),
                                               rings(1)};
    std::vector<Direction> side, meridian, horizon;
    for (const Direction& d : ubo2014_directions()) {
      if (unit_vector(d)[0] > 0.2) side.push_back(d);
    }
    for (int theta = 0; theta <= 90; theta += 15) meridian.push_back(direction_from_degrees(theta, 30));
    for (int phi = 0; phi < 360; phi += 20) horizon.push_back(direction_from_degrees(90, phi));
    all.insert(all.end(),
               {side, meridian, horizon, {direction_from_degrees(60, 10), direction_from_degrees(60, 20)}});
    return all;
  }();
  return sets;
}

TEST(Corners, OfMeasuredDirectionsAreThemselves) {
  for (const auto& set : direction_sets()) {
    const Table table(set);
    for (std::uint32_t i = 0; i < set.size(); ++i) {
      for (const float length : {1.0f, 0.01f, 1000.0f}) {
        const BtfcCorners c = table.corners(vector_of(set[i]) * length);
        float own = 0, others = 0;
        for (int k = 0; k < 3; ++k) (c.index[k] == i ? own : others) += c.weight[k];
        EXPECT_EQ(own, 1.0f) << "direction " << i << " of " << set.size();
        EXPECT_EQ(others, 0.0f);
      }
    }
  }
}

// Inside the hull the weighted corners are the point itself; outside, the hull's nearest point.
TEST(Corners, OfAnyDirectionAreTheNearestPointOfTheHull) {
  std::mt19937_64 random(5);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (const auto& set : direction_sets()) {
    const Table table(set);
    const Triangulation t = triangulate(table.points);
    for (int round = 0; round < 2000; ++round) {
      const double z = round % 10 == 0 ? -uniform() : uniform(), phi = uniform() * 2 * std::numbers::pi;
      const double r = std::sqrt(1 - z * z);
      const vec3 d(static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                   static_cast<float>(z));
      const BtfcCorners c = table.corners(d);
      double px = 0, py = 0, sum = 0;
      for (int k = 0; k < 3; ++k) {
        ASSERT_LT(c.index[k], set.size());
        ASSERT_GE(c.weight[k], 0.0f);
        sum += static_cast<double>(c.weight[k]);
        px += static_cast<double>(c.weight[k]) * table.points[c.index[k]].x / kPointUnit;
        py += static_cast<double>(c.weight[k]) * table.points[c.index[k]].y / kPointUnit;
      }
      EXPECT_NEAR(sum, 1, 1e-6);
      const double length = std::hypot(r, std::max(z, 0.0)) + std::max(z, 0.0);
      const double qx = r * std::cos(phi) / length, qy = r * std::sin(phi) / length;
      // Distance to the hull by brute force: 0 inside, else to the nearest border segment.
      bool inside = !t.triangles.empty();
      double nearest = HUGE_VAL;
      for (const auto& [a, b] : t.border) {
        const double ax = table.points[a].x / double{kPointUnit}, ay = table.points[a].y / double{kPointUnit};
        const double bx = table.points[b].x / double{kPointUnit} - ax,
                     by = table.points[b].y / double{kPointUnit} - ay;
        inside = inside && bx * (qy - ay) - by * (qx - ax) >= 0;
        const double square = bx * bx + by * by;
        const double s = square > 0 ? std::clamp(((qx - ax) * bx + (qy - ay) * by) / square, 0.0, 1.0) : 0;
        nearest = std::min(nearest, std::hypot(ax + s * bx - qx, ay + s * by - qy));
      }
      EXPECT_NEAR(std::hypot(px - qx, py - qy), inside ? 0 : nearest, 1e-4);
    }
  }
}

TEST(Corners, OfNonsenseAreTheNormals) {
  const Table table(ubo2003_directions());
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  for (const vec3& d : {vec3(0, 0, 0), vec3(nan, 0, 1), vec3(0, 0, nan), vec3(infinity, 0, 0),
                        vec3(nan, nan, nan), vec3(0, 0, -1), vec3(1e-30f, 0, 0), vec3(3e38f, 3e38f, 3e38f)}) {
    const BtfcCorners c = table.corners(d);
    for (int k = 0; k < 3; ++k) {
      EXPECT_TRUE(c.weight[k] >= 0 && c.weight[k] <= 1);
      if (c.weight[k] > 0) {
        EXPECT_EQ(c.index[k], 0u);
      }
    }
  }
}

TEST(DirectionPoints, KeepAnglesToTheHorizon) {
  for (double theta = 0; theta <= 90; theta += 7.5) {
    for (double phi = 0; phi < 360; phi += 11.25) {
      const Direction d = direction_from_degrees(theta, phi);
      const Point p = point_of(d.theta, d.phi);
      EXPECT_LE(std::int64_t{p.x} * p.x + std::int64_t{p.y} * p.y, std::int64_t{kPointUnit} * kPointUnit);
      EXPECT_LT(angle_between(d, direction_from_vector(unit_vector(p))), 1.2e-7);
    }
  }
}

Head head_of(const Directions& d) {
  Head head;
  head.views = static_cast<std::uint32_t>(d.views.size());
  head.lights = static_cast<std::uint32_t>(d.lights.size());
  head.pairs = static_cast<std::uint32_t>(d.pairs.size());
  return head;
}

TEST(MissingPairs, StandForTheNearestLightOfTheView) {
  std::mt19937 random(9);
  Directions d{points_of(ubo2003_directions()), points_of(rings(3)), {}};
  for (std::uint16_t v = 0; v < d.views.size(); ++v) {
    for (std::uint16_t l = 0; l < d.lights.size(); ++l) {
      if (l == v % d.lights.size() || random() % 3 == 0) d.pairs.push_back({v, l});
    }
  }
  std::vector<std::uint32_t> words;
  const DirectionWords at = append_direction_words(d, words);
  EXPECT_EQ(words.size(), direction_words(head_of(d)));
  for (std::uint32_t v = 0; v < d.views.size(); ++v) {
    for (std::uint32_t l = 0; l < d.lights.size(); ++l) {
      const std::uint32_t found =
          btfc_pair({{words.data()}}, at.pairs, static_cast<std::uint32_t>(d.lights.size()), v, l);
      std::int64_t best = INT64_MAX;
      std::uint32_t expected = 0;
      for (std::uint32_t p = 0; p < d.pairs.size(); ++p) {
        if (d.pairs[p].view != v) continue;
        const std::int64_t x = d.lights[l].x - d.lights[d.pairs[p].light].x,
                           y = d.lights[l].y - d.lights[d.pairs[p].light].y;
        if (x * x + y * y < best) {
          best = x * x + y * y;
          expected = p;
        }
      }
      ASSERT_EQ(found, expected);
    }
  }
}

TEST(Dirs, RoundTripAndRules) {
  Directions d{points_of(rings(2)), points_of(rings(1)), all_pairs(19, 7)};
  EXPECT_EQ(*read_directions(head_of(d), write_directions(d)), d);
  d.pairs.erase(d.pairs.begin() + 5);
  const Head head = head_of(d);
  const Bytes good = write_directions(d);
  EXPECT_EQ(good.size(), directions_chunk(head).raw_bytes);
  EXPECT_EQ(*read_directions(head, good), d);

  const auto rule = [&](Bytes raw) {
    const Result<Directions> read = read_directions(head, raw);
    return std::string(read ? "" : read.error().rule);
  };
  Bytes bad = good;
  store_u32(&bad[0], static_cast<std::uint32_t>(kPointUnit + 1));
  EXPECT_EQ(rule(bad), "V3");
  bad = good;
  std::copy_n(&good[8], 8, &bad[0]);
  EXPECT_EQ(rule(bad), "V3");
  bad = good;
  store_u32(&bad[0], 0x80000000u);
  EXPECT_EQ(rule(bad), "V3");
  store_u32(&bad[4], 0x80000000u);  // whose squares do not fit together into 64 bits
  EXPECT_EQ(rule(bad), "V3");
  const std::size_t pairs = 8 * (19 + 7);
  bad = good;
  store_u16(&bad[pairs], 19);
  EXPECT_EQ(rule(bad), "V4");
  bad = good;
  std::copy_n(&good[pairs + 4], 4, &bad[pairs]);
  EXPECT_EQ(rule(bad), "V4");
  bad = good;  // the last view loses its only pair to the one before
  Directions lonely{points_of(rings(1)), points_of(rings(1)), {}};
  for (std::uint16_t v = 0; v < 6; ++v) {
    for (std::uint16_t l = 0; l < 7; ++l) lonely.pairs.push_back({v, l});
  }
  const Result<Directions> read = read_directions(head_of(lonely), write_directions(lonely));
  ASSERT_FALSE(read);
  EXPECT_STREQ(read.error().rule, "V4");

  Head many;
  many.views = 1025;
  many.lights = 1;
  many.pairs = 1025;
  EXPECT_STREQ(check_direction_counts(many).error().rule, "V1");
  many.views = 4;
  many.lights = 3;
  many.pairs = 3;
  EXPECT_STREQ(check_direction_counts(many).error().rule, "V1");
}

}  // namespace
}  // namespace btfc::test
