// A factor's marginal distribution: values <-> normal scores, and the table that turns scores back.
#pragma once
#include <vector>

#include "encoder/fields/plane.h"

namespace btfc {

// Each value's normal score, the quantile of the standard normal distribution at its rank; equal values share
// their mean rank. (Heitz and Neyret 2018 gaussianise so, in the decorrelated colours of Deliot and Heitz
// 2019.)
FieldPlane normal_scores(const FieldPlane& plane);

// Quantiles of the values at the scores of `knots` knots from -3 to 3 (spec/models/car.md section 5.5).
std::vector<float> marginal_table(const FieldPlane& plane, std::uint32_t knots);

// The steepest rise of a table, per unit of score.
double steepest(const std::vector<float>& table);

}  // namespace btfc
