// Settings that differ in one whole number, and what is to be expected of those that were not tried.
#pragma once
#include <string>
#include <vector>

namespace btfc {

// What is expected of a setting. quality: the larger the better, dB or a negative distance.
struct Expected {
  double quality = 0, bytes = 0, operations = 0;
};

// One setting that was measured.
struct FamilyPoint {
  double dial = 0;
  Expected is;
};

// The settings of a model that differ in its dial alone (Fitter::dial), or one setting of a model without.
struct SettingFamily {
  std::string model, options;             // options: without the dial
  std::string dial;                       // its name; empty: none, and one point
  std::vector<FamilyPoint> points;        // by rising dial
  double quality_off = 0, bytes_off = 0;  // what a fit of the whole input has shown predictions to be off by

  // Between points, and by their ends' slopes beyond: quality over the logarithm of the dial, where it is
  // nearly straight; bytes and operations over the dial itself.
  Expected at(double dial) const;
  double least_dial() const;
  double most_dial() const;
};

// Leaves the points that a line between two others does not pass above, so that settings which a fit of its
// own would do better do not count. points: in any order.
std::vector<FamilyPoint> best_points(std::vector<FamilyPoint> points);

}  // namespace btfc
