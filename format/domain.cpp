// DOMN <-> struct, and whether a query lies inside.
#include "format/domain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "format/directions.h"

namespace btfc {
namespace {

constexpr std::size_t kFixedBytes = 68;
using Direction3 = std::array<double, 3>;

constexpr float kQuarterTurn = static_cast<float>(std::numbers::pi / 2),
                kWholeTurn = static_cast<float>(2 * std::numbers::pi);

bool between(float v, float least, float most) { return v >= least && v <= most; }  // false of NaN

bool good_range(const DirectionRange& r) {
  return between(r.theta_least, 0, kQuarterTurn) && between(r.theta_most, r.theta_least, kQuarterTurn) &&
         between(r.phi_from, 0, kWholeTurn) && between(r.phi_width, 0, kWholeTurn);
}

bool lists(DomainKind kind) { return kind == DomainKind::list || kind == DomainKind::pairs; }

// Rules DM2 to DM4 on one side.
std::optional<Error> side_fault(const char* what, const DomainSide& side) {
  if (lists(side.kind) == side.points.empty()) {
    return invalid("DM2", 0,
                   fmt::format("DOMN lists {} {}, expected some where its kind is list or pairs, otherwise "
                               "none",
                               side.points.size(), what));
  }
  if (side.kind != DomainKind::range && !(side.range == DirectionRange{}))
    return invalid("DM2", 0, fmt::format("DOMN has a range of {} that are of another kind", what));
  if (!good_range(side.range)) {
    return invalid("DM3", 0,
                   fmt::format("DOMN's range of {} is ({}, {}, {}, {}), expected 0 <= theta_least <= "
                               "theta_most <= pi / 2, azimuths within a turn",
                               what, side.range.theta_least, side.range.theta_most, side.range.phi_from,
                               side.range.phi_width));
  }
  for (std::size_t i = 0; i < side.points.size(); ++i) {
    const std::int64_t x = side.points[i].x, y = side.points[i].y;
    if (std::abs(x) > kPointUnit || std::abs(y) > kPointUnit ||
        x * x + y * y > std::int64_t{kPointUnit} * kPointUnit) {
      return invalid("DM4", 0,
                     fmt::format("entry {} of DOMN's {} is ({}, {}), expected a point within 2^24 of the "
                                 "origin",
                                 i, what, x, y));
    }
  }
  return std::nullopt;
}

double dot(const Direction3& a, const Direction3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// By the chord: exact for small angles, which acos is not.
double angle(const Direction3& a, const Direction3& b) {
  const Direction3 d = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return 2 * std::asin(std::min(1.0, std::sqrt(dot(d, d)) / 2));
}

// To the meridian at phi between two angles from the normal.
double angle_to_arc(double phi, double least, double most, const Direction3& d) {
  const double along = d[0] * std::cos(phi) + d[1] * std::sin(phi);
  const double theta = std::clamp(std::atan2(along, d[2]), least, most);
  return angle({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}, d);
}

std::int64_t turn(const DirectionPoint& a, const DirectionPoint& b, const DirectionPoint& c) {
  return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
         (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

bool side_covers(const DomainSide& side, double radius, double tolerance, const Direction3& d) {
  if (side.kind == DomainKind::all) return true;
  if (side.kind == DomainKind::range) return angle_to_range(side.range, d) <= tolerance;
  return std::any_of(side.points.begin(), side.points.end(),
                     [&](const DirectionPoint& p) { return angle_to_point(p, d) <= radius + tolerance; });
}

}  // namespace

Bytes write_domain(const Domain& d) {
  Bytes raw(kFixedBytes + 8 * (d.views.points.size() + d.lights.points.size()));
  raw[0] = static_cast<std::uint8_t>(d.views.kind);
  raw[1] = static_cast<std::uint8_t>(d.lights.kind);
  raw[2] = static_cast<std::uint8_t>(d.scale_log2);
  store_f32(&raw[4], d.tolerance);
  store_f32(&raw[8], d.radius);
  store_u32(&raw[12], d.origin_x);
  store_u32(&raw[16], d.origin_y);
  store_f32(&raw[20], d.footprint_least);
  store_f32(&raw[24], d.footprint_most);
  store_u32(&raw[28], static_cast<std::uint32_t>(d.views.points.size()));
  store_u32(&raw[32], static_cast<std::uint32_t>(d.lights.points.size()));
  std::uint8_t* to = &raw[36];
  for (const DirectionRange* r : {&d.views.range, &d.lights.range}) {
    for (const float v : {r->theta_least, r->theta_most, r->phi_from, r->phi_width}) {
      store_f32(to, v);
      to += 4;
    }
  }
  for (const auto* points : {&d.views.points, &d.lights.points}) {
    for (const DirectionPoint& p : *points) {
      store_u32(to, static_cast<std::uint32_t>(p.x));
      store_u32(to + 4, static_cast<std::uint32_t>(p.y));
      to += 8;
    }
  }
  return raw;
}

Result<Domain> read_domain(const Head& head, ByteView raw) {
  const std::uint64_t views = raw.size() < kFixedBytes ? 0 : load_u32(&raw[28]),
                      lights = raw.size() < kFixedBytes ? 0 : load_u32(&raw[32]);
  if (views > kMaxDomainDirections || lights > kMaxDomainDirections ||
      raw.size() != kFixedBytes + 8 * (views + lights)) {
    return invalid("DM1", 0,
                   fmt::format("DOMN has {} bytes and lists {} views and {} lights, expected 68 bytes and 8 "
                               "for each of at most 65536",
                               raw.size(), views, lights));
  }
  Domain d;
  const auto good_kind = [](std::uint8_t kind) { return kind <= static_cast<int>(DomainKind::pairs); };
  d.views.kind = static_cast<DomainKind>(raw[0]);
  d.lights.kind = static_cast<DomainKind>(raw[1]);
  d.scale_log2 = raw[2];
  const bool joint = d.views.kind == DomainKind::pairs;
  if (!good_kind(raw[0]) || !good_kind(raw[1]) || joint != (d.lights.kind == DomainKind::pairs) ||
      (joint && views != lights) || d.scale_log2 > kMaxScaleLog2 || raw[3] != 0) {
    return invalid("DM2", 0,
                   fmt::format("DOMN has kinds {} and {}, scale_log2 {} and lists of {} and {}, expected "
                               "kinds 0 to 3, 3 for both or none and then as many, scale_log2 at most 16, "
                               "the reserved byte 0",
                               raw[0], raw[1], d.scale_log2, views, lights));
  }
  d.tolerance = load_f32(&raw[4]);
  d.radius = load_f32(&raw[8]);
  d.origin_x = load_u32(&raw[12]);
  d.origin_y = load_u32(&raw[16]);
  d.footprint_least = load_f32(&raw[20]);
  d.footprint_most = load_f32(&raw[24]);
  const std::uint8_t* from = &raw[36];
  for (DirectionRange* r : {&d.views.range, &d.lights.range}) {
    *r = {load_f32(from), load_f32(from + 4), load_f32(from + 8), load_f32(from + 12)};
    from += 16;
  }
  from = &raw[0] + kFixedBytes;
  const auto points = [&](std::uint64_t count) {
    std::vector<DirectionPoint> list(count);
    for (DirectionPoint& p : list) {
      p = {static_cast<std::int32_t>(load_u32(from)), static_cast<std::int32_t>(load_u32(from + 4))};
      from += 8;
    }
    return list;
  };
  d.views.points = points(views);
  d.lights.points = points(lights);
  if (!between(d.tolerance, 0, kQuarterTurn) || !between(d.radius, 0, kQuarterTurn) ||
      !between(d.footprint_least, 0, std::numeric_limits<float>::max()) ||
      !between(d.footprint_most, d.footprint_least, std::numeric_limits<float>::max())) {
    return invalid("DM3", 0,
                   fmt::format("DOMN has tolerance {}, radius {} and footprints {} to {}, expected angles of "
                               "0 to pi / 2 and finite footprints in order",
                               d.tolerance, d.radius, d.footprint_least, d.footprint_most));
  }
  if (auto fault = side_fault("views", d.views)) return *fault;
  if (auto fault = side_fault("lights", d.lights)) return *fault;
  const auto fits = [&](std::uint32_t origin, std::uint32_t size) {
    return std::uint64_t{origin} + (std::uint64_t{size} << d.scale_log2) <= std::uint64_t{1} << 32;
  };
  if (!fits(d.origin_x, head.width) || !fits(d.origin_y, head.height)) {
    return invalid(
        "DM5", 0,
        fmt::format("DOMN puts texel (0, 0) at ({}, {}), {} texels each: {}x{} of them end beyond "
                    "2^32",
                    d.origin_x, d.origin_y, std::uint64_t{1} << d.scale_log2, head.width, head.height));
  }
  return d;
}

std::vector<DirectionPoint> convex_hull(std::vector<DirectionPoint> points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  // Andrew's monotone chain: the lower side from left to right, then the upper one back.
  std::vector<DirectionPoint> hull;
  const auto add = [&](const DirectionPoint& p, std::size_t least) {
    while (hull.size() > least && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const DirectionPoint& p : points) add(p, 1);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower);
  hull.pop_back();
  return hull;
}

std::array<double, 3> surface_direction(const std::array<double, 3>& v) {
  const double z = std::max(v[2], 0.0), length = std::hypot(v[0], v[1], z);
  if (!(length + z > 1e-18 && length + z < 1e18)) return {0, 0, 1};
  return {v[0] / length, v[1] / length, z / length};
}

double angle_to_point(const DirectionPoint& point, const Direction3& d) {
  return angle(unit_vector(point), d);
}

double angle_to_span(std::span<const DirectionPoint> hull, const Direction3& d) {
  const double x = d[0] / (1 + d[2]) * kPointUnit, y = d[1] / (1 + d[2]) * kPointUnit;
  bool inside = hull.size() > 2;
  double best = std::numeric_limits<double>::infinity();
  Direction3 nearest{};
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const DirectionPoint &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const double sx = double{1} * b.x - a.x, sy = double{1} * b.y - a.y, px = x - a.x, py = y - a.y;
    inside = inside && sx * py - sy * px >= 0;
    const double length = sx * sx + sy * sy;
    const double t = length > 0 ? std::clamp((sx * px + sy * py) / length, 0.0, 1.0) : 0;
    const double off = std::hypot(px - t * sx, py - t * sy);
    if (off >= best) continue;
    best = off;
    const double u = (a.x + t * sx) / kPointUnit, v = (a.y + t * sy) / kPointUnit, s = u * u + v * v;
    nearest = {2 * u / (1 + s), 2 * v / (1 + s), (1 - s) / (1 + s)};
  }
  if (inside) return 0;
  return hull.empty() ? best : angle(nearest, d);
}

double angle_to_range(const DirectionRange& r, const Direction3& d) {
  const double theta = std::atan2(std::hypot(d[0], d[1]), d[2]);
  const double turns = 2 * std::numbers::pi;
  const double behind = std::fmod(std::atan2(d[1], d[0]) - r.phi_from + 2 * turns, turns);
  if (behind <= r.phi_width) return std::abs(theta - std::clamp<double>(theta, r.theta_least, r.theta_most));
  return std::min(angle_to_arc(r.phi_from, r.theta_least, r.theta_most, d),
                  angle_to_arc(double{r.phi_from} + r.phi_width, r.theta_least, r.theta_most, d));
}

std::uint32_t covered(const Domain& domain, std::span<const DirectionPoint> view_hull,
                      std::span<const DirectionPoint> light_hull, const Direction3& view,
                      const Direction3& light, float footprint) {
  const auto spans = [&](std::span<const DirectionPoint> hull, const Direction3& d) {
    return hull.empty() || angle_to_span(hull, d) <= domain.tolerance;
  };
  const double reach = double{domain.radius} + domain.tolerance;
  bool lit = side_covers(domain.lights, domain.radius, domain.tolerance, light);
  if (domain.lights.kind == DomainKind::pairs) {
    lit = false;
    for (std::size_t i = 0; i < domain.lights.points.size() && !lit; ++i) {
      lit = angle_to_point(domain.views.points[i], view) <= reach &&
            angle_to_point(domain.lights.points[i], light) <= reach;
    }
  }
  std::uint32_t flags = 0;
  if (spans(view_hull, view) && side_covers(domain.views, domain.radius, domain.tolerance, view))
    flags |= kCoversView;
  if (spans(light_hull, light) && lit) flags |= kCoversLight;
  if (footprint >= domain.footprint_least && footprint <= domain.footprint_most) flags |= kCoversFootprint;
  return flags;
}

}  // namespace btfc
