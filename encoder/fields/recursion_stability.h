// Whether a causal recursion of the plane has a stationary solution.
#pragma once
#include <span>

#include "encoder/linear/matrix.h"
#include "format/models/field_shape.h"

namespace btfc {

// Y(x, y) = sum over s of A_s Y(x + dx_s, y + dy_s) + noise, Y of d channels; coefficients: d x d a
// neighbour, row by row (of d = 1 a number a neighbour). A recursion over a half plane is stable where
// (Dudgeon and Mersereau 1984, section 4.3) the recursion along a row is, and, for every frequency w along
// the rows, so is the one from row to row, sum over k of C_k(w) z^-k with C_k(w) = sum over dy = -k of A_s
// exp(i w dx). Returned: the largest size of a root of either, at 128 frequencies; below 1 it is stable.
// Infinite where a row has no solution.
double recursion_radius(std::span<const FieldOffset> offsets, std::span<const double> coefficients,
                        std::size_t d);

// a_s rho^(|dx| + |dy|): moves all roots towards 0.
std::vector<double> shrunk(std::span<const FieldOffset> offsets, std::span<const double> coefficients,
                           std::size_t d, double rho);

}  // namespace btfc
