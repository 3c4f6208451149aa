// Data set -> a mean image and eigenimages a view -> chunks. Two readings: the lights' covariances, then the
// images.
#include "encoder/models/pcarf_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/dataset/view_pairs.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/models/weighted_code.h"
#include "encoder/run_on_threads.h"
#include "format/models/pcarf_payload.h"

namespace btfc {
namespace {

// The columns of a view, each row less its mean; and the means.
struct Centred {
  Matrix values;
  Eigen::VectorXf means;
};

Centred centred(const Matrix& block, const ViewPairs& run) {
  Centred c{block.middleCols(as_index(run.first), as_index(run.count)), {}};
  c.means = c.values.cast<double>().rowwise().mean().cast<float>();
  c.values.colwise() -= c.means;
  return c;
}

// B^T B of each view, in double.
std::vector<MatrixD> covariances(const RowBlocks& rows, const std::vector<ViewPairs>& runs) {
  std::vector<MatrixD> sums;
  for (const ViewPairs& run : runs) sums.push_back(MatrixD::Zero(as_index(run.count), as_index(run.count)));
  std::vector<std::vector<Matrix>> partial(kPartials, std::vector<Matrix>(runs.size()));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t, std::size_t place) {
        for (std::size_t v = 0; v < runs.size(); ++v) {
          const Matrix m = centred(block, runs[v]).values;
          partial[place][v].noalias() = m.transpose() * m;
        }
      },
      [&](std::size_t place) {
        for (std::size_t v = 0; v < runs.size(); ++v) sums[v] += partial[place][v].cast<double>();
      });
  return sums;
}

// Images of all views: means (column 0) and components, rows (texel, channel).
std::vector<Matrix> project(const RowBlocks& rows, const std::vector<ViewPairs>& runs,
                            const std::vector<Matrix>& weights, std::uint32_t rank) {
  std::vector<Matrix> images(runs.size(), Matrix(as_index(rows.rows), as_index(rank + 1)));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        const Eigen::Index first = as_index(number * rows.block_rows);
        for (std::size_t v = 0; v < runs.size(); ++v) {
          auto part = images[v].middleRows(first, block.rows());
          const Centred c = centred(block, runs[v]);
          part.col(0) = c.means;
          if (rank > 0) part.rightCols(as_index(rank)).noalias() = c.values * weights[v];
        }
      },
      [](std::size_t) {});
  return images;
}

}  // namespace

const std::span<const OptionSpec> kPcarfFitOptions = kWeightedOptions;

Result<FitResult> pcarf_fit(const FitInput& input, const FitSettings& settings) {
  Result<WeightedShape> wanted = weighted_shape_from_options(settings.options);
  if (!wanted) return wanted.error();
  WeightedShape& shape = *wanted;
  const DatasetInfo& info = input.dataset->info();
  const Result<DatasetHead> described = dataset_head(info, ModelId::pcarf);
  if (!described) return described.error();

  const std::vector<ViewPairs> runs = pairs_of_views(info);
  const std::size_t channels = info.channels.size(), texels = std::size_t{info.width} * info.height;
  std::size_t most = 0;
  for (const ViewPairs& run : runs) most = std::max(most, run.count);
  // Centred rows of n lights have rank n - 1 at most.
  shape.rank = static_cast<std::uint32_t>(std::min({std::size_t{shape.rank}, most - 1, texels * channels}));
  if (const auto fits = read_weighted_parm(kPcarfModel, described->head, write_weighted_parm(shape)); !fits)
    return fits.error();

  const RowBlocks rows = image_rows(*input.dataset, false);
  std::vector<Matrix> weights, images;
  double left_out = 0;
  run_on_threads(settings.threads, [&] {
    for (const MatrixD& covariance : covariances(rows, runs)) {
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
      const Eigen::Index size = covariance.rows(), kept = std::min(size, as_index(shape.rank));
      Matrix w = Matrix::Zero(size, as_index(shape.rank));
      for (Eigen::Index k = 0; k < kept; ++k) w.col(k) = eigen.eigenvectors().col(size - 1 - k).cast<float>();
      left_out += eigen.eigenvalues().head(size - kept).cwiseMax(0).sum();
      weights.push_back(std::move(w));
    }
    images = project(rows, runs, weights, shape.rank);
  });

  WeightedImages payload;
  payload.directions = described->directions;
  for (const Matrix& image : images)
    payload.means.push_back(code_image(image.col(0), channels, shape.texels));
  for (std::uint32_t k = 0; k < shape.rank; ++k) {
    std::vector<float> row(info.pairs.size());
    auto& coded = payload.images.emplace_back();
    for (std::size_t v = 0; v < runs.size(); ++v) {
      auto [image, largest] = code_eigenimage(images[v].col(as_index(k + 1)), channels, shape.texels);
      for (std::size_t i = 0; i < runs[v].count; ++i)
        row[runs[v].first + i] = largest * weights[v](as_index(i), as_index(k));
      coded.push_back(std::move(image));
    }
    payload.weights.push_back(code_rows(row, 1, row.size(), shape.tables));
  }

  FitResult result;
  result.chunks = weighted_write(kPcarfModel, described->head, shape, payload);
  const double samples = static_cast<double>(texels * channels) * static_cast<double>(info.pairs.size());
  result.report = {{"rank", std::to_string(shape.rank)},
                   {"svd_rmse", fmt::format("{:.6g}", std::sqrt(left_out / samples))}};
  return result;
}

}  // namespace btfc
