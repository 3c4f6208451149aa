// Data set -> a mean image and eigenimages a view -> chunks. Two readings: the lights' covariances, then the
// images.
#include "encoder/models/pcarf_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/run_on_threads.h"
#include "format/models/pcarf_payload.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"rank", "K", "components k of each view beside its mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of images and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the table of weights (default: as --precision)"},
};

// The pairs of a view: a run of columns, since pairs are ordered by view.
struct Run {
  Eigen::Index first = 0, count = 0;
};

std::vector<Run> runs_of(const DatasetInfo& info) {
  std::vector<Run> runs(info.views.size());
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    Run& run = runs[info.pairs[p].view];
    if (run.count++ == 0) run.first = as_index(p);
  }
  return runs;
}

// The columns of a view, each row less its mean.
Matrix centred(const Matrix& block, const Run& run) {
  Matrix m = block.middleCols(run.first, run.count);
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    m.row(r).array() -= static_cast<float>(m.row(r).cast<double>().mean());
  return m;
}

// B^T B of each view, in double.
std::vector<MatrixD> covariances(const RowBlocks& rows, const std::vector<Run>& runs) {
  std::vector<MatrixD> sums;
  for (const Run& run : runs) sums.push_back(MatrixD::Zero(run.count, run.count));
  std::vector<std::vector<Matrix>> partial(kPartials, std::vector<Matrix>(runs.size()));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t, std::size_t place) {
        for (std::size_t v = 0; v < runs.size(); ++v) {
          const Matrix m = centred(block, runs[v]);
          partial[place][v].noalias() = m.transpose() * m;
        }
      },
      [&](std::size_t place) {
        for (std::size_t v = 0; v < runs.size(); ++v) sums[v] += partial[place][v].cast<double>();
      });
  return sums;
}

// Images of all views: means (column 0) and components, rows (texel, channel).
std::vector<Matrix> project(const RowBlocks& rows, const std::vector<Run>& runs,
                            const std::vector<Matrix>& weights, std::uint32_t rank) {
  std::vector<Matrix> images(runs.size(), Matrix(as_index(rows.rows), as_index(rank + 1)));
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        const Eigen::Index first = as_index(number * rows.block_rows);
        for (std::size_t v = 0; v < runs.size(); ++v) {
          auto part = images[v].middleRows(first, block.rows());
          const Matrix m = block.middleCols(runs[v].first, runs[v].count);
          for (Eigen::Index r = 0; r < m.rows(); ++r)
            part(r, 0) = static_cast<float>(m.row(r).cast<double>().mean());
          if (rank > 0) part.rightCols(as_index(rank)).noalias() = centred(block, runs[v]) * weights[v];
        }
      },
      [](std::size_t) {});
  return images;
}

// A column (texel, channel) -> rows of channels.
std::vector<float> planar(const Eigen::Ref<const Eigen::VectorXf>& column, std::size_t channels) {
  const auto size = static_cast<std::size_t>(column.size());
  std::vector<float> rows(size);
  for (std::size_t i = 0; i < size; ++i)
    rows[i % channels * (size / channels) + i / channels] = column(as_index(i));
  return rows;
}

}  // namespace

const std::span<const OptionSpec> kPcarfFitOptions = kOptions;

Result<FitResult> pcarf_fit(const FitInput& input, const FitSettings& settings) {
  const auto rank = parse_u32(settings.options, "rank", 0, kPcarfMostRank);
  if (!rank) return rank.error();
  const auto precision = parse_precision(settings.options, "precision", Precision::f32);
  if (!precision) return precision.error();
  const auto tables = parse_precision(settings.options, "table-precision", *precision);
  if (!tables) return tables.error();
  const DatasetInfo& info = input.dataset->info();
  const Result<DatasetHead> described = dataset_head(info, ModelId::pcarf);
  if (!described) return described.error();

  const std::vector<Run> runs = runs_of(info);
  const std::size_t channels = info.channels.size(), texels = std::size_t{info.width} * info.height;
  Eigen::Index most = 0;
  for (const Run& run : runs) most = std::max(most, run.count);
  PcarfShape shape{rank->value_or(8), *precision, *tables};
  // Centred rows of n lights have rank n - 1 at most.
  shape.rank =
      std::min({shape.rank, static_cast<std::uint32_t>(most - 1),
                static_cast<std::uint32_t>(std::min<std::size_t>(texels * channels, kPcarfMostRank))});
  if (const auto fits = read_pcarf_parm(described->head, write_pcarf_parm(shape)); !fits) return fits.error();

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

  PcarfPayload payload;
  payload.directions = described->directions;
  for (const Matrix& image : images)
    payload.means.push_back(code_rows(planar(image.col(0), channels), channels, texels, shape.texels));
  for (std::uint32_t k = 0; k < shape.rank; ++k) {
    std::vector<float> row(info.pairs.size());
    auto& coded = payload.images.emplace_back();
    for (std::size_t v = 0; v < runs.size(); ++v) {
      Eigen::VectorXf image = images[v].col(as_index(k + 1));
      // The largest pixel is 1: half floats and bytes see the same range in all views.
      const float largest = image.cwiseAbs().maxCoeff();
      if (largest > 0) image /= largest;
      for (Eigen::Index i = 0; i < runs[v].count; ++i)
        row[static_cast<std::size_t>(runs[v].first + i)] = largest * weights[v](i, as_index(k));
      coded.push_back(code_rows(planar(image, channels), channels, texels, shape.texels));
    }
    payload.weights.push_back(code_rows(row, 1, row.size(), shape.tables));
  }

  FitResult result;
  result.chunks = pcarf_write(described->head, shape, payload);
  const double samples = static_cast<double>(texels * channels) * static_cast<double>(info.pairs.size());
  result.report = {{"rank", std::to_string(shape.rank)},
                   {"svd_rmse", fmt::format("{:.6g}", std::sqrt(left_out / samples))}};
  return result;
}

}  // namespace btfc
