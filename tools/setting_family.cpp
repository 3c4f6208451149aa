// Interpolation, and the hull that it runs along.
#include "tools/setting_family.h"

#include <algorithm>
#include <cmath>

namespace btfc {
namespace {

double place(double dial) { return std::log2(1 + dial); }

double along(double from_x, double from, double to_x, double to, double x) {
  return from + (to - from) * (x - from_x) / (to_x - from_x);
}

}  // namespace

std::vector<FamilyPoint> best_points(std::vector<FamilyPoint> points) {
  std::sort(points.begin(), points.end(), [](const FamilyPoint& a, const FamilyPoint& b) {
    return std::pair(a.dial, -a.is.quality) < std::pair(b.dial, -b.is.quality);
  });
  points.erase(std::unique(points.begin(), points.end(),
                           [](const FamilyPoint& a, const FamilyPoint& b) { return a.dial == b.dial; }),
               points.end());
  std::vector<FamilyPoint> hull;
  for (const FamilyPoint& p : points) {
    const auto below = [&] {
      if (hull.size() < 2) return false;
      const FamilyPoint &a = hull[hull.size() - 2], &b = hull.back();
      return b.is.quality <= along(place(a.dial), a.is.quality, place(p.dial), p.is.quality, place(b.dial));
    };
    while (below()) hull.pop_back();
    hull.push_back(p);
  }
  return hull;
}

double SettingFamily::least_dial() const {
  // A rank may be 0, a mixture has one component.
  return dial.empty() ? points.front().dial : std::min(points.front().dial, 1.0);
}

double SettingFamily::most_dial() const { return dial.empty() ? points.back().dial : 2 * points.back().dial; }

Expected SettingFamily::at(double x) const {
  Expected e = points.front().is;
  if (points.size() > 1) {
    std::size_t i = 1;
    while (i + 1 < points.size() && points[i].dial < x) ++i;
    const FamilyPoint &a = points[i - 1], &b = points[i];
    e.quality = along(place(a.dial), a.is.quality, place(b.dial), b.is.quality, place(x));
    e.bytes = along(a.dial, a.is.bytes, b.dial, b.is.bytes, x);
    e.operations = along(a.dial, a.is.operations, b.dial, b.is.operations, x);
  }
  e.quality += quality_off;
  e.bytes += bytes_off;
  return e;
}

}  // namespace btfc
