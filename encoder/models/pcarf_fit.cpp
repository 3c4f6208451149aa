// Data set -> a mean image and eigenimages a view -> chunks. Two readings: the lights' covariances, then the
// images. A view's lights count by their weights among themselves: views share nothing.
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

constexpr double kLeastEnergy = 1e-8;  // of the largest, where lights have weights

// Where a view's columns stand, and what they count: shares of the mean, and roots of the weights that they
// are multiplied by; none where all lights count alike. weight: the mean one.
struct View {
  ViewPairs run;
  Eigen::VectorXd shares, roots;
  double weight = 0;
};

View view_of(const DatasetInfo& info, const ViewPairs& run) {
  const std::vector<double> weights = weights_of(info, run);
  const Eigen::Map<const Eigen::VectorXd> w(weights.data(), as_index(weights.size()));
  double sum = 0;
  for (std::size_t pair = run.first; pair < run.first + run.count; ++pair) sum += info.weight(pair);
  const double count = std::max(1.0, static_cast<double>(run.count));
  return {run, w / count, w.cwiseSqrt(), sum / count};
}

// The columns of a view, each row less its mean, times the roots; and the means.
struct Centred {
  Matrix values;
  Eigen::VectorXf means;
};

Centred centred(const Matrix& block, const View& view) {
  Centred c{block.middleCols(as_index(view.run.first), as_index(view.run.count)), {}};
  if (view.shares.size() == 0) {
    c.means = c.values.cast<double>().rowwise().mean().cast<float>();
    c.values.colwise() -= c.means;
  } else {
    c.means = (c.values.cast<double>() * view.shares).cast<float>();
    c.values.colwise() -= c.means;
    c.values *= view.roots.cast<float>().asDiagonal();
  }
  return c;
}

// B^T B of each view, in double.
std::vector<MatrixD> covariances(const RowBlocks& rows, const std::vector<View>& views) {
  std::vector<MatrixD> sums;
  for (const View& view : views)
    sums.push_back(MatrixD::Zero(as_index(view.run.count), as_index(view.run.count)));
  std::vector<std::vector<Matrix>> partial(kPartials, std::vector<Matrix>(views.size()));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t, std::size_t place) {
        for (std::size_t v = 0; v < views.size(); ++v) {
          const Matrix m = centred(block, views[v]).values;
          partial[place][v].noalias() = m.transpose() * m;
        }
      },
      [&](std::size_t place) {
        for (std::size_t v = 0; v < views.size(); ++v) sums[v] += partial[place][v].cast<double>();
      });
  return sums;
}

// A view's components over its lights: the axes whose sums of the centred columns are the images, and the
// weights of the images in each light. left_out: squared error by weights.
struct LightAxes {
  Matrix axes, weights;
  double left_out = 0;
};

LightAxes light_axes(const MatrixD& covariance, const Eigen::VectorXd& roots, std::uint32_t rank) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const Eigen::Index size = covariance.rows(), kept = std::min(size, as_index(rank));
  Matrix w = Matrix::Zero(size, as_index(rank));
  for (Eigen::Index k = 0; k < kept; ++k) w.col(k) = eigen.eigenvectors().col(size - 1 - k).cast<float>();
  const double left_out = eigen.eigenvalues().head(size - kept).cwiseMax(0).sum();
  if (roots.size() == 0) return {w, w, left_out};
  // With the images given, a light's weights are a least squares problem of its own, which what the light
  // counts does not change: C e / (lambda root). To divide e by the root gives the same in exact arithmetic,
  // but lights that hardly count are lost in the rounding of those that do. Images that single precision
  // cannot tell from the others' rounding are left out.
  LightAxes result{Matrix::Zero(size, as_index(rank)), Matrix::Zero(size, as_index(rank)), left_out};
  for (Eigen::Index k = 0; k < kept; ++k) {
    const double energy = eigen.eigenvalues()(size - 1 - k);
    if (!(energy > kLeastEnergy * eigen.eigenvalues()(size - 1))) break;
    result.axes.col(k) = w.col(k);
    result.weights.col(k) =
        (covariance * eigen.eigenvectors().col(size - 1 - k)).cwiseQuotient(energy * roots).cast<float>();
  }
  return result;
}

// Images of all views: means (column 0) and components, rows (texel, channel).
std::vector<Matrix> project(const RowBlocks& rows, const std::vector<View>& views,
                            const std::vector<LightAxes>& axes, std::uint32_t rank) {
  std::vector<Matrix> images(views.size(), Matrix(as_index(rows.rows), as_index(rank + 1)));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        const Eigen::Index first = as_index(number * rows.block_rows);
        for (std::size_t v = 0; v < views.size(); ++v) {
          auto part = images[v].middleRows(first, block.rows());
          const Centred c = centred(block, views[v]);
          part.col(0) = c.means;
          if (rank > 0) part.rightCols(as_index(rank)).noalias() = c.values * axes[v].axes;
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
  std::vector<View> views;
  for (const ViewPairs& run : runs) views.push_back(view_of(info, run));
  std::vector<LightAxes> axes;
  std::vector<Matrix> images;
  double left_out = 0;
  run_on_threads(settings.threads, [&] {
    for (const MatrixD& covariance : covariances(rows, views)) {
      const View& view = views[axes.size()];
      axes.push_back(light_axes(covariance, view.roots, shape.rank));
      left_out += view.weight * axes.back().left_out;
    }
    images = project(rows, views, axes, shape.rank);
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
        row[runs[v].first + i] = largest * axes[v].weights(as_index(i), as_index(k));
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
