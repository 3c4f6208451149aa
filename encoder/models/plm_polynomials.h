// Polynomials that bring the images of lobes nearer to the measured ones (survey, eq. 4).
#pragma once
#include <functional>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "format/directions.h"

namespace btfc {

// Lobes of one view as decoders read them: parameter m of channel c of texel t at (m channels + c) texels +
// t.
using LobePlanes = std::vector<float>;

enum class PlmPolynomial { none, histogram, least_squares };

struct PlmPolynomials {
  std::vector<float> terms;  // b_j of channel c of pair p at ((j - 1) channels + c) pairs + p
  std::size_t kept = 0;      // of all pairs and channels, how many are not the identity 1, 0, 0, 0, 0
  double lobe_squares = 0;   // sum of squares by the pairs' weights that the lobes alone leave over
  double squares = 0;        // and with the polynomials
};

// Of each pair's image and channel: histogram, the polynomial nearest to the map from values of the lobes'
// image to the measured ones of the same rank, which matches the cumulative histograms; least_squares, the
// one nearest to the measured values themselves. Both are drawn towards the identity, as weakly as leaves a
// curve that stays near the values of its view; and give way to the identity where they do not lower its
// error. none: the identity everywhere, for the errors.
PlmPolynomials fit_polynomials(const Dataset& dataset, const Directions& directions,
                               const std::vector<LobePlanes>& views, PlmPolynomial kind,
                               const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace btfc
