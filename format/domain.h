// DOMN: for which views, lights and footprints a file was made, and what it shows of the original
// (spec/btfc.md section 5.4).
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "format/chunk.h"
#include "format/head.h"
#include "format/result.h"
#include "format/triangulation.h"

namespace btfc {

inline constexpr std::uint32_t kDomn = four_cc("DOMN");
inline constexpr std::uint32_t kMaxDomainDirections = 65536;  // a list, rule DM1
inline constexpr std::uint64_t kMaxDomainBytes = 68 + 16 * std::uint64_t{kMaxDomainDirections};
inline constexpr std::uint32_t kMaxScaleLog2 = 16;                                     // rule DM2
inline constexpr float kDefaultTolerance = static_cast<float>(std::numbers::pi / 90);  // 2 degrees

// Numbers of the registry. pairs: views[i] belongs to lights[i], and both sides are of this kind.
enum class DomainKind : std::uint8_t { all, range, list, pairs };

// Radians. The azimuths from phi_from on, phi_width further; at the normal any azimuth is meant.
struct DirectionRange {
  float theta_least = 0, theta_most = 0, phi_from = 0, phi_width = 0;
  bool operator==(const DirectionRange&) const = default;
};

struct DomainSide {
  DomainKind kind = DomainKind::all;
  DirectionRange range;                // of kind range, otherwise zeros
  std::vector<DirectionPoint> points;  // of kinds list and pairs
  bool operator==(const DomainSide&) const = default;
};

// Without the chunk a file's domain is this: what its directions span.
struct Domain {
  DomainSide views, lights;
  float tolerance = kDefaultTolerance;       // radians
  float radius = 0;                          // what a listed direction stands for, radians about it
  std::uint32_t origin_x = 0, origin_y = 0;  // texel (0, 0) in the original
  std::uint32_t scale_log2 = 0;              // a texel is a square of 2^scale_log2 of the original's
  float footprint_least = 0, footprint_most = std::numeric_limits<float>::max();  // texels of the file
  bool operator==(const Domain&) const = default;
};

inline constexpr std::uint32_t kCoversView = 1, kCoversLight = 2, kCoversFootprint = 4;

Bytes write_domain(const Domain& domain);
// Rules DM1 to DM5.
Result<Domain> read_domain(const Head& head, ByteView raw);

// The corners of the smallest convex polygon around points, counter-clockwise, its sides' inner points left
// out; one or two of points that lie on a line. Empty of none.
std::vector<DirectionPoint> convex_hull(std::vector<DirectionPoint> points);

// As spec/tables.md section 4 takes a direction: any length, below the surface the horizon. Unit length.
std::array<double, 3> surface_direction(const std::array<double, 3>& v);

// Radians from a surface_direction to the nearest direction of what a hull spans (nearest in the
// projection); infinite where the hull is empty.
double angle_to_span(std::span<const DirectionPoint> hull, const std::array<double, 3>& direction);
// The same to a range, and to one point.
double angle_to_range(const DirectionRange& range, const std::array<double, 3>& direction);
double angle_to_point(const DirectionPoint& point, const std::array<double, 3>& direction);

// kCovers… flags of what a domain says, the hulls being those of the file's directions (empty: a file
// without directions, which has an answer for all).
std::uint32_t covered(const Domain& domain, std::span<const DirectionPoint> view_hull,
                      std::span<const DirectionPoint> light_hull, const std::array<double, 3>& view,
                      const std::array<double, 3>& light, float footprint);

}  // namespace btfc
