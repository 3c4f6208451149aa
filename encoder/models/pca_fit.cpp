// Data set -> mean image, eigenimages, weights -> chunks.
#include "encoder/models/pca_fit.h"

#include <fmt/format.h>

#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/linear/truncated_svd.h"
#include "encoder/models/weighted_code.h"
#include "encoder/run_on_threads.h"
#include "format/models/pca_payload.h"

namespace btfc {
const std::span<const OptionSpec> kPcaFitOptions = kWeightedOptions;

Result<FitResult> pca_fit(const FitInput& input, const FitSettings& settings) {
  Result<WeightedShape> wanted = weighted_shape_from_options(settings.options);
  if (!wanted) return wanted.error();
  WeightedShape& shape = *wanted;
  const Dataset& dataset = *input.dataset;
  const Result<DatasetHead> described = dataset_head(dataset.info(), ModelId::pca);
  if (!described) return described.error();

  if (const auto fits = read_weighted_parm(kPcaModel, described->head, write_weighted_parm(shape)); !fits)
    return fits.error();
  std::vector<float> mean;
  TruncatedSvd svd;
  run_on_threads(settings.threads, [&] {
    mean = mean_image(dataset);
    SvdOptions options;
    options.seed = settings.seed;
    options.progress = settings.progress;
    svd = weighted_svd(image_rows(dataset, true), dataset.info().weights, shape.rank, options);
  });
  shape.rank = static_cast<std::uint32_t>(svd.right.cols());

  const Head& head = described->head;
  const std::size_t channels = dataset.info().channels.size();
  WeightedImages payload;
  payload.directions = described->directions;
  payload.means = {code_image(Eigen::Map<const Eigen::VectorXf>(mean.data(), as_index(mean.size())), channels,
                              shape.texels)};
  for (std::uint32_t k = 0; k < shape.rank; ++k) {
    auto [image, largest] = code_eigenimage(svd.left.col(k), channels, shape.texels);
    const Eigen::VectorXf weights = svd.right.col(k) * largest;
    payload.images.push_back({std::move(image)});
    payload.weights.push_back(
        code_rows({weights.data(), static_cast<std::size_t>(weights.size())}, 1, head.pairs, shape.tables));
  }

  FitResult result;
  result.chunks = weighted_write(kPcaModel, head, shape, payload);
  result.meta["pca.seed"] = std::to_string(settings.seed);
  double left_out = svd.total_energy;
  for (const double e : svd.energy) left_out -= e;
  const double rows = static_cast<double>(mean.size()) * static_cast<double>(head.pairs);
  result.report = {{"rank", std::to_string(shape.rank)},
                   {"svd_passes", std::to_string(svd.passes)},
                   {"svd_rmse", fmt::format("{:.6g}", std::sqrt(std::max(left_out, 0.0) / rows))}};
  return result;
}

}  // namespace btfc
