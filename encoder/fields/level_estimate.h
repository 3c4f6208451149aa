// A level's model of one subspace, as estimated, repaired and rounded.
#pragma once
#include <cstdint>
#include <vector>

#include "encoder/fields/neighbour_moments.h"
#include "encoder/fields/plane.h"
#include "format/models/field_shape.h"

namespace btfc {

// The posterior mode of the normal-gamma prior (paper eq. 8): coefficients V_x^-1 V_xy with V_x(0) = 1e-6 of
// the texels' variance on the diagonal. d x d a neighbour, row by row, d the moments' planes.
std::vector<double> estimate_coefficients(const NeighbourMoments& moments, std::uint64_t mask);

// The mean square, over planes, of what the coefficients do not predict (lambda / beta of eq. 8).
double prediction_error(const NeighbourMoments& moments, std::uint64_t mask,
                        const std::vector<double>& coefficients);

// The covariance of what they do not predict, d x d.
MatrixD residual_covariance(const NeighbourMoments& moments, std::uint64_t mask,
                            const std::vector<double>& coefficients);

// The same estimate texel by texel (paper, section 2.3: "can be also evaluated recursively"): the inverse of
// V_x is kept by the matrix inversion lemma.
class RecursiveEstimate {
 public:
  // prior: V_x(0) = prior I.
  RecursiveEstimate(std::size_t neighbours, double prior);
  void add(const Eigen::VectorXd& neighbours, double value);
  const Eigen::VectorXd& coefficients() const { return coefficients_; }
  double prediction_error() const { return count_ > 0 ? lambda_ / count_ : 0; }

 private:
  MatrixD inverse_;
  Eigen::VectorXd coefficients_;
  double lambda_ = 0, count_ = 0;
};

// What is asked of a level's model.
struct LevelDemand {
  Precision precision = Precision::f16;
  std::uint32_t level = 0;
  std::vector<double> variance;  // of each plane: what the field is to have
  std::vector<double> weight;    // how much a plane's error of 1 moves a value
  double error = 1e-3;           // of values, that the level may add
};

struct LevelModel {
  std::vector<float> numbers;  // as FLDS holds them, rounded to the precision
  std::uint32_t margin = 4;    // within which the demanded error is kept; gmrf: 0
  std::vector<double> tail;    // by margin, 0 … kMostFittedMargin: a bound on what it leaves out of values
  double radius = 0;           // of the coefficients as estimated, recursion_stability.h; gmrf: 1 - the least
                               // denominator of the spectrum
  double repaired_radius = 0;
  double shrink = 1;           // rho
  double likelihood_lost = 0;  // nats: samples / 2 log(prediction error after / before), planes together
};

inline constexpr std::uint32_t kMostFittedMargin = 127;

// Shrinks the coefficients a_s rho^(|dx| + |dy|) with the largest rho <= 1 that makes the recursion stable
// and lets it die away to the demanded error within kMostFittedMargin texels; then sets the noise so that the
// field has the demanded variance.
LevelModel settle_recursion(const NeighbourMoments& moments, std::uint64_t mask, const LevelDemand& demand);

// The same of gmrf: all coefficients by one rho, so that the spectrum on the torus is positive and at most
// 1000 times the noise's.
LevelModel settle_markov(const NeighbourMoments& moments, std::uint64_t mask, std::uint32_t side,
                         const LevelDemand& demand);

}  // namespace btfc
