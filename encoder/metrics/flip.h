// LDR-FLIP: how large a difference an observer sees who flips between two images.
#pragma once
#include <vector>

#include "encoder/metrics/code_view.h"

namespace btfc {

// Pixels per degree of a display 0.7 m wide with 3840 pixels, seen from 0.7 m (Andersson et al. 2020).
inline constexpr double kFlipPixelsPerDegree = 67.0206432765823;

// Filters along one axis, for one number of pixels per degree. Made once; read from any thread.
struct FlipFilters {
  // A sum of separable Gaussians, one or two, of weights that sum to 1.
  struct Gaussian {
    std::vector<float> taps;  // 2 radius + 1 of them, sum 1
    float weight = 1;
  };
  std::vector<Gaussian> achromatic, red_green, blue_yellow;
  // Feature detectors: the Gaussian across, first (edges) and second (points) derivative along.
  std::vector<float> across, edge, point;
};
// pixels_per_degree: at least 10.
FlipFilters flip_filters(double pixels_per_degree = kFlipPixelsPerDegree);

// The mean over texels of the error, 0 … 1 (Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem,
// Fairchild, "FLIP: A Difference Evaluator for Alternating Images", HPG 2020; black against white is 0.967).
// Borders are clamped, any size will do. Both have the same size and a meaning; grey counts as R = G = B.
// `map`, where given, becomes width x height errors in rows. Holds a few dozen rows, not planes; single
// precision, within 10^-4 of the formulas. Thread-safe and deterministic.
double flip_by_rows(const CodeView& a, const CodeView& b, const FlipFilters& filters,
                    std::vector<float>* map = nullptr);

}  // namespace btfc
