// Directions: angles, vectors, and the published sampling grids.
#include "encoder/dataset/direction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace btfc {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// phi in [0, 2 pi); a hair below a whole turn is the turn's begin, so that 360 and -1e-17 give 0.
double whole_turns_off(double phi) {
  double rest = std::fmod(phi, kTurn);
  if (rest < 0) rest += kTurn;
  return kTurn - rest < 1e-9 ? 0 : rest;
}

// A ring of `count` azimuths from `first` degrees on.
struct Ring {
  double theta;
  int count;
  double first;
};

std::vector<Direction> directions_of(std::span<const Ring> rings) {
  std::vector<Direction> out;
  for (const Ring& ring : rings) {
    for (int i = 0; i < ring.count; ++i) {
      out.push_back(direction_from_degrees(ring.theta, ring.first + 360.0 * i / ring.count));
    }
  }
  return out;
}

}  // namespace

Direction direction_from_degrees(double theta, double phi) {
  return {theta * std::numbers::pi / 180, whole_turns_off(phi * std::numbers::pi / 180)};
}

Direction direction_from_vector(const Vector3& v) {
  return {std::atan2(std::hypot(v[0], v[1]), v[2]), whole_turns_off(std::atan2(v[1], v[0]))};
}

Vector3 unit_vector(const Direction& d) {
  return {std::sin(d.theta) * std::cos(d.phi), std::sin(d.theta) * std::sin(d.phi), std::cos(d.theta)};
}

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

double angle_between(const Direction& a, const Direction& b) {
  // By the chord: accurate for small angles, where the arc cosine of a dot product is not.
  const Vector3 p = unit_vector(a), q = unit_vector(b);
  const double chord = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  return 2 * std::asin(std::min(1.0, chord / 2));
}

bool same_direction(const Direction& a, const Direction& b) { return angle_between(a, b) < 1e-5; }

double typical_step(std::span<const Direction> directions) {
  double sum = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    double nearest = 0.5;
    for (std::size_t j = 0; j < directions.size(); ++j) {
      if (i != j) nearest = std::min(nearest, angle_between(directions[i], directions[j]));
    }
    sum += nearest;
  }
  return sum / static_cast<double>(directions.size());
}

std::string to_text(const Direction& d) {
  const auto round4 = [](double v) { return std::round(v * 1e4) / 1e4 + 0.0; };
  return fmt::format("({}, {})", round4(degrees(d.theta)), round4(degrees(d.phi)));
}

std::vector<Direction> ubo2003_directions() {
  static constexpr Ring kRings[] = {{0, 1, 0},   {15, 6, 0},  {30, 12, 0},
                                    {45, 18, 0}, {60, 20, 0}, {75, 24, 0}};
  return directions_of(kRings);
}

std::vector<Direction> ubo2014_directions() {
  static constexpr Ring kRings[] = {{0, 1, 0},       {11, 6, 15}, {23.5, 12, 0},   {30, 12, 15},
                                    {37.5, 12, 0},   {45, 18, 0}, {52.5, 18, 7.5}, {60, 24, 0},
                                    {67.5, 24, 7.5}, {75, 24, 0}};
  return directions_of(kRings);
}

}  // namespace btfc
