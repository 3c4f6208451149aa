// Roots as eigenvalues of companion matrices.
#include "encoder/fields/recursion_stability.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

namespace btfc {
namespace {

constexpr int kReach = 4, kFrequencies = 128;
using MatrixC = Eigen::MatrixXcd;

// The largest eigenvalue's size of z^4 = sum over k = 1 … 4 of B_k z^(4 - k).
double companion_radius(const std::vector<MatrixC>& b, Eigen::Index d) {
  MatrixC m = MatrixC::Zero(kReach * d, kReach * d);
  int last = 0;
  for (int k = 0; k < kReach; ++k) {
    m.block(0, k * d, d, d) = b[static_cast<std::size_t>(k)];
    if (!b[static_cast<std::size_t>(k)].isZero(0)) last = k + 1;
    if (k > 0) m.block(k * d, (k - 1) * d, d, d).setIdentity();
  }
  if (last == 0) return 0;
  const MatrixC used = m.topLeftCorner(last * d, last * d);
  return Eigen::ComplexEigenSolver<MatrixC>(used, false).eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

double recursion_radius(std::span<const FieldOffset> offsets, std::span<const double> coefficients,
                        std::size_t d) {
  const auto n = static_cast<Eigen::Index>(d);
  const auto matrix = [&](std::size_t s) {
    MatrixC a(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        a(i, j) = coefficients[s * d * d + static_cast<std::size_t>(i * n + j)];
    }
    return a;
  };
  std::vector<MatrixC> row(kReach, MatrixC::Zero(n, n));
  bool above = false;
  for (std::size_t s = 0; s < offsets.size(); ++s) {
    if (offsets[s].dy == 0) row[static_cast<std::size_t>(-offsets[s].dx - 1)] = matrix(s);
    above = above || offsets[s].dy != 0;
  }
  double radius = companion_radius(row, n);
  if (radius >= 1) return radius;
  for (int f = 0; f <= kFrequencies / 2 && above; ++f) {
    const double w = 2 * std::numbers::pi * f / kFrequencies;
    MatrixC own = MatrixC::Identity(n, n);
    std::vector<MatrixC> b(kReach, MatrixC::Zero(n, n));
    for (std::size_t s = 0; s < offsets.size(); ++s) {
      const MatrixC term = matrix(s) * std::polar(1.0, w * offsets[s].dx);
      if (offsets[s].dy == 0) {
        own -= term;
      } else {
        b[static_cast<std::size_t>(-offsets[s].dy - 1)] += term;
      }
    }
    const Eigen::FullPivLU<MatrixC> lu(own);
    if (!lu.isInvertible()) return std::numeric_limits<double>::infinity();
    for (MatrixC& k : b) k = lu.solve(k).eval();
    radius = std::max(radius, companion_radius(b, n));
  }
  return radius;
}

std::vector<double> shrunk(std::span<const FieldOffset> offsets, std::span<const double> coefficients,
                           std::size_t d, double rho) {
  std::vector<double> out(coefficients.begin(), coefficients.end());
  for (std::size_t s = 0; s < offsets.size(); ++s) {
    const double factor = std::pow(rho, std::abs(offsets[s].dx) + std::abs(offsets[s].dy));
    for (std::size_t i = 0; i < d * d; ++i) out[s * d * d + i] *= factor;
  }
  return out;
}

}  // namespace btfc
