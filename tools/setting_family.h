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
  bool own = true;  // a fit of its own; else a part of a larger one, which its own might beat
};

// The settings of a model that differ in its dial alone (Fitter::dial), or one setting of a model without.
struct SettingFamily {
  std::string model, options;       // options: without the dial
  std::string dial;                 // its name; empty: none, and one point
  std::vector<FamilyPoint> points;  // by rising dial
  std::vector<FamilyPoint> off;  // by rising dial: how fits of the whole input differ from the points' line
  double doubt = 0;              // added to quality until there is such a fit

  // Between points, and by their ends' slopes beyond: quality over the logarithm of the dial, where it is
  // nearly straight; bytes and operations over the dial itself. What it is off by likewise.
  Expected at(double dial) const;
  double least_dial() const;
  double most_dial() const;
  // What a fit of the whole input came to.
  void learn(double dial, const Expected& measured);
};

// By rising dial, of each the best; fits of their own alone where there are several. points: in any order.
std::vector<FamilyPoint> telling_points(std::vector<FamilyPoint> points);

}  // namespace btfc
