// Data set -> coefficients of eq. 2 -> chunks.
#include "encoder/models/ptm_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "encoder/dataset/dataset_head.h"
#include "encoder/dataset/view_pairs.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/run_on_threads.h"
#include "format/models/ptm_payload.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"precision", "f32|f16|u8", "of the coefficients (default f32; of an RGB .ptm file u8, as it is)"},
};

constexpr double kLeastSingularValue = 1e-4;  // of the largest

// Coefficients of one view as chunks hold them: row (term, channel), terms in the order of levels.
using ViewRows = std::vector<float>;

// The matrices of one view in single precision.
struct ViewSolver {
  ViewPairs pairs;
  Matrix solve;              // pairs x 6
  Matrix evaluate;           // 6 x pairs
  Eigen::RowVectorXd roots;  // of the pairs' weights; none: all alike
};

struct Fitted {
  std::vector<ViewRows> views;
  double squares = 0;  // of what the coefficients leave over
};

Fitted fit_views(const Dataset& dataset, const std::vector<ViewSolver>& solvers,
                 const std::function<void(std::size_t, std::size_t)>& progress) {
  const std::size_t channels = dataset.info().channels.size();
  const RowBlocks rows = image_rows(dataset, false);
  const std::size_t texels = rows.rows / channels;
  Fitted fitted;
  fitted.views.assign(solvers.size(), ViewRows(kPtmTerms * rows.rows));
  std::array<double, kPartials> squares{};
  std::size_t done = 0;
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t place) {
        double sum = 0;
        for (std::size_t v = 0; v < solvers.size(); ++v) {
          const ViewSolver& solver = solvers[v];
          const auto values = block.middleCols(as_index(solver.pairs.first), as_index(solver.pairs.count));
          const Matrix coefficients = values * solver.solve;
          if (solver.roots.size() == 0) {
            sum += (values - coefficients * solver.evaluate).cast<double>().squaredNorm();
          } else {
            sum += ((values - coefficients * solver.evaluate).cast<double>() * solver.roots.asDiagonal())
                       .squaredNorm();
          }
          for (Eigen::Index r = 0; r < block.rows(); ++r) {
            const std::size_t row = number * rows.block_rows + static_cast<std::size_t>(r);
            const std::size_t texel = row / channels, channel = row % channels;
            for (std::size_t k = 0; k < kPtmTerms; ++k) {
              fitted.views[v][(k * channels + channel) * texels + texel] =
                  coefficients(r, as_index(kPtmTermOrder[k]));
            }
          }
        }
        squares[place] = sum;
      },
      [&](std::size_t place) {
        fitted.squares += squares[place];
        if (progress) progress(++done, rows.count());
      });
  return fitted;
}

}  // namespace

const std::span<const OptionSpec> kPtmFitOptions = kOptions;

PtmInverse ptm_inverse(const std::vector<Vector3>& lights, std::span<const double> weights) {
  PtmInverse result;
  result.terms.resize(as_index(lights.size()), kPtmTerms);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const double u = lights[i][0], v = lights[i][1];
    result.terms.row(as_index(i)) << u * u, v * v, u * v, u, v, 1;
  }
  Eigen::VectorXd roots(as_index(weights.size()));
  for (std::size_t i = 0; i < weights.size(); ++i) roots[as_index(i)] = std::sqrt(weights[i]);
  const Eigen::MatrixXd weighted =
      weights.empty() ? Eigen::MatrixXd(result.terms) : Eigen::MatrixXd(roots.asDiagonal() * result.terms);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(weighted, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& s = svd.singularValues();
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(s.size());
  for (Eigen::Index i = 0; i < s.size(); ++i) {
    if (!(s[i] > kLeastSingularValue * s[0])) continue;
    inverse[i] = 1 / s[i];
    ++result.rank;
  }
  result.inverse = svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose();
  if (!weights.empty()) result.inverse = result.inverse * roots.asDiagonal();
  return result;
}

Result<FitResult> ptm_fit(const FitInput& input, const FitSettings& settings) {
  const auto precision = parse_precision(settings.options, "precision", Precision::f32);
  if (!precision) return precision.error();
  const Dataset& dataset = *input.dataset;
  const Result<DatasetHead> described = dataset_head(dataset.info(), ModelId::ptm);
  if (!described) return described.error();
  const PtmShape shape{*precision};
  if (const auto fits = read_ptm_parm(described->head, write_ptm_parm(shape)); !fits) return fits.error();

  std::vector<ViewSolver> solvers;
  std::uint32_t least_rank = kPtmTerms;
  for (const ViewPairs& pairs : pairs_of_views(dataset.info())) {
    const PtmInverse inverse =
        ptm_inverse(lights_of(described->directions, pairs), weights_of(dataset.info(), pairs));
    Eigen::RowVectorXd roots(as_index(dataset.info().weights.empty() ? 0 : pairs.count));
    for (Eigen::Index i = 0; i < roots.size(); ++i)
      roots[i] = std::sqrt(dataset.info().weight(pairs.first + static_cast<std::size_t>(i)));
    solvers.push_back(
        {pairs, inverse.inverse.transpose().cast<float>(), inverse.terms.transpose().cast<float>(), roots});
    least_rank = std::min(least_rank, inverse.rank);
  }
  Fitted fitted;
  run_on_threads(settings.threads, [&] { fitted = fit_views(dataset, solvers, settings.progress); });

  const std::size_t channels = dataset.info().channels.size();
  const std::size_t texels = std::size_t{dataset.info().width} * dataset.info().height;
  PtmPayload payload;
  payload.directions = described->directions;
  for (ViewRows& rows : fitted.views) {
    PtmView view;
    for (std::uint32_t level = 0; level < kPtmLevels; ++level) {
      const std::size_t first = kPtmFirstTerm[level] * channels, end = kPtmFirstTerm[level + 1] * channels;
      view[level] = code_rows(std::span(rows).subspan(first * texels, (end - first) * texels), end - first,
                              texels, shape.precision);
    }
    payload.views.push_back(std::move(view));
    ViewRows().swap(rows);  // large sets: not twice in memory
  }

  FitResult result;
  result.chunks = ptm_write(described->head, shape, payload);
  const double samples =
      static_cast<double>(texels * channels) * static_cast<double>(dataset.info().pairs.size());
  result.report = {{"least_rank", std::to_string(least_rank)},
                   {"fit_rmse", fmt::format("{:.6g}", std::sqrt(fitted.squares / samples))}};
  return result;
}

}  // namespace btfc
