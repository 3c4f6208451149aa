// Eigenvectors of the channels' covariance.
#include "encoder/fields/colour_factors.h"

namespace btfc {

ColourFactors colour_factors(const std::vector<FieldPlane>& channels, const std::optional<MatrixD>& like) {
  const auto d = as_index(channels.size());
  const std::size_t texels = channels[0].values.size();
  ColourFactors out;
  for (const FieldPlane& c : channels) out.mean.push_back(mean_of(c));
  MatrixD covariance = MatrixD::Zero(d, d);
  for (Eigen::Index i = 0; i < d; ++i) {
    for (Eigen::Index j = i; j < d; ++j) {
      const auto &a = channels[static_cast<std::size_t>(i)].values,
                 &b = channels[static_cast<std::size_t>(j)].values;
      double sum = 0;
      for (std::size_t t = 0; t < texels; ++t)
        sum +=
            (a[t] - out.mean[static_cast<std::size_t>(i)]) * (b[t] - out.mean[static_cast<std::size_t>(j)]);
      covariance(i, j) = covariance(j, i) = sum / static_cast<double>(texels);
    }
  }
  const Eigen::SelfAdjointEigenSolver<MatrixD> solver(covariance);
  out.basis = solver.eigenvectors().rowwise().reverse();  // Eigen has them by rising variance
  for (Eigen::Index f = 0; f < d; ++f) {
    const double sign = like ? out.basis.col(f).dot(like->col(f)) : out.basis.col(f).sum();
    if (sign < 0) out.basis.col(f) *= -1;
  }
  for (Eigen::Index f = 0; f < d; ++f) {
    FieldPlane plane = channels[0];
    for (std::size_t t = 0; t < texels; ++t) {
      double sum = 0;
      for (Eigen::Index c = 0; c < d; ++c) {
        const auto n = static_cast<std::size_t>(c);
        sum += out.basis(c, f) * (channels[n].values[t] - out.mean[n]);
      }
      plane.values[t] = sum;
    }
    out.factors.push_back(std::move(plane));
  }
  return out;
}

}  // namespace btfc
