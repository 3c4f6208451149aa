// Directions of views and lights in the material's frame (spec/btfc.md section 3).
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

namespace btfc {

// Radians. theta from the normal, 0 … pi/2; phi from x (image right) towards y (image top), 0 <= phi < 2 pi.
// Points away from the surface. At theta 0 phi is kept as given: data sets name it.
struct Direction {
  double theta = 0, phi = 0;
  bool operator==(const Direction&) const = default;
};

using Vector3 = std::array<double, 3>;

// Whole turns are taken off phi (360 is 0, -180 is 180). theta is taken as it is.
Direction direction_from_degrees(double theta, double phi);
// Of a vector of any length above 0 with z >= 0.
Direction direction_from_vector(const Vector3& v);
Vector3 unit_vector(const Direction& d);
double degrees(double radians);

// The angle between two directions, radians.
double angle_between(const Direction& a, const Direction& b);
// Whether two directions are nearer than 1e-5 radians: names of files round to 0.1 degrees at best.
bool same_direction(const Direction& a, const Direction& b);

// The mean angle from a direction to its nearest neighbour, each taken as 0.5 radians at most.
double typical_step(std::span<const Direction> directions);

// "(30, 120)": theta and phi in degrees, at most four decimals.
std::string to_text(const Direction& d);

// The 81 directions of UBO2003 and the 151 of UBO2014, in the order of the published lists
// (rings of constant theta, from the normal outwards).
std::vector<Direction> ubo2003_directions();
std::vector<Direction> ubo2014_directions();

}  // namespace btfc
