// CIE 1976 L*a*b* of display colours, and mean differences in it.
#pragma once
#include <array>
#include <span>

#include "encoder/metrics/code_view.h"

namespace btfc {

// The display's curve: sRGB-coded 0 … 1 to linear light (IEC 61966-2-1).
double linear_of_srgb(double v);
// And back, of any size.
double srgb_of_linear(double v);

// L* in 0 … 100, a* and b* in about -110 … 110; white is D65, observer 2 degrees.
using Lab = std::array<double, 3>;

// Linear Rec. 709 -> tristimulus values over those of white; rows have the sum 1, so that grey has no colour.
using Matrix3 = std::array<std::array<double, 3>, 3>;
const Matrix3& white_xyz_of_rec709();

// Of linear Rec. 709, each 0 … 1. In double: the plain form of lab_row.
Lab lab_of_linear(double red, double green, double blue);

// The same for a row, in place, single precision: within 2 10^-4 of lab_of_linear.
void lab_row(std::span<float> red_l, std::span<float> green_a, std::span<float> blue_b);

// mae: the mean of |dL*|, |da*| and |db*| over texels and the three components, the "MAE in CIE Lab" of
// Filip and Haindl 2009 (table 5, figure 10), who leave open how components are weighted: here
// equally. A grey image counts as R = G = B, its da* and db* as zeros. de76: the mean of the Euclidean
// distances.
struct LabDifference {
  double mae = 0, de76 = 0;
};

// Both have the same size and a meaning. Deterministic; single precision but for the sums.
LabDifference lab_difference(const CodeView& a, const CodeView& b);

}  // namespace btfc
