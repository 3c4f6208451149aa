// The matrices of the fits: Eigen's, with products by BLAS.
#pragma once
#define EIGEN_USE_BLAS
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <Eigen/Dense>
#pragma GCC diagnostic pop

namespace btfc {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixD = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Eigen::Index as_index(std::size_t n) { return static_cast<Eigen::Index>(n); }

}  // namespace btfc
