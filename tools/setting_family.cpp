// Interpolation, and the points that it runs along.
#include "tools/setting_family.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace btfc {
namespace {

double place(double dial) { return std::log2(1 + dial); }

double along(double from_x, double from, double to_x, double to, double x) {
  return from + (to - from) * (x - from_x) / (to_x - from_x);
}

// Two settings whose dials are nearer than this say nothing of a slope.
constexpr double kLeastPlaces = 0.1;

// Along the points, and on beyond their ends.
Expected along_points(const std::vector<FamilyPoint>& points, double x) {
  Expected e = points.front().is;
  if (points.size() < 2) return e;
  std::size_t i = 1;
  while (i + 1 < points.size() && points[i].dial < x) ++i;
  const FamilyPoint &a = points[i - 1], &b = points[i];
  e.quality = along(place(a.dial), a.is.quality, place(b.dial), b.is.quality, place(x));
  e.bytes = along(a.dial, a.is.bytes, b.dial, b.is.bytes, x);
  e.operations = along(a.dial, a.is.operations, b.dial, b.is.operations, x);
  return e;
}

void sort_by_dial(std::vector<FamilyPoint>& points) {
  std::sort(points.begin(), points.end(), [](const FamilyPoint& a, const FamilyPoint& b) {
    return std::pair(a.dial, -a.is.quality) < std::pair(b.dial, -b.is.quality);
  });
}

}  // namespace

std::vector<FamilyPoint> telling_points(std::vector<FamilyPoint> points) {
  std::set<double> own;
  for (const FamilyPoint& p : points) {
    if (p.own) own.insert(p.dial);
  }
  if (own.size() > 1) std::erase_if(points, [](const FamilyPoint& p) { return !p.own; });
  sort_by_dial(points);
  points.erase(std::unique(points.begin(), points.end(),
                           [](const FamilyPoint& a, const FamilyPoint& b) { return a.dial == b.dial; }),
               points.end());
  return points;
}

double SettingFamily::least_dial() const {
  // A rank may be 0, a mixture has one component.
  return dial.empty() ? points.front().dial : std::min(points.front().dial, 1.0);
}

double SettingFamily::most_dial() const { return dial.empty() ? points.back().dial : 2 * points.back().dial; }

Expected SettingFamily::at(double x) const {
  Expected e = along_points(points, x);
  if (off.empty()) {
    e.quality += doubt;
    return e;
  }
  const Expected more = along_points(off, x);
  e.quality += more.quality;
  e.bytes += more.bytes;
  e.operations += more.operations;
  return e;
}

void SettingFamily::learn(double x, const Expected& measured) {
  const Expected line = along_points(points, x);
  std::erase_if(off, [&](const FamilyPoint& p) { return std::abs(place(p.dial) - place(x)) < kLeastPlaces; });
  off.push_back({x,
                 {measured.quality - line.quality, measured.bytes - line.bytes,
                  measured.operations - line.operations}});
  sort_by_dial(off);
}

}  // namespace btfc
