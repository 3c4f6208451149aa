// Data set -> mean image, eigenimages, weights -> chunks.
#include "encoder/models/pca_fit.h"

#include <fmt/format.h>

#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/linear/truncated_svd.h"
#include "encoder/run_on_threads.h"
#include "format/models/pca_payload.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"rank", "K", "components k beside the mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of images and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the table of weights (default: as --precision)"},
};

// Columns of (texel, channel) -> rows of channels, columns of texels.
std::vector<float> planar(std::span<const float> interleaved, std::size_t channels) {
  std::vector<float> rows(interleaved.size());
  const std::size_t texels = interleaved.size() / channels;
  for (std::size_t i = 0; i < interleaved.size(); ++i)
    rows[i % channels * texels + i / channels] = interleaved[i];
  return rows;
}

}  // namespace

const std::span<const OptionSpec> kPcaFitOptions = kOptions;

Result<FitResult> pca_fit(const FitInput& input, const FitSettings& settings) {
  const auto rank = parse_u32(settings.options, "rank", 0, kPcaMostRank);
  if (!rank) return rank.error();
  const auto precision = parse_precision(settings.options, "precision", Precision::f32);
  if (!precision) return precision.error();
  const auto tables = parse_precision(settings.options, "table-precision", *precision);
  if (!tables) return tables.error();
  const Dataset& dataset = *input.dataset;
  const Result<DatasetHead> described = dataset_head(dataset.info(), ModelId::pca);
  if (!described) return described.error();

  PcaShape shape{rank->value_or(8), *precision, *tables};
  if (const auto fits = read_pca_parm(described->head, write_pca_parm(shape)); !fits) return fits.error();
  std::vector<float> mean;
  TruncatedSvd svd;
  run_on_threads(settings.threads, [&] {
    mean = mean_image(dataset);
    SvdOptions options;
    options.seed = settings.seed;
    options.progress = settings.progress;
    svd = truncated_svd(image_rows(dataset, true), shape.rank, options);
  });
  shape.rank = static_cast<std::uint32_t>(svd.right.cols());

  const std::size_t channels = dataset.info().channels.size(), texels = mean.size() / channels;
  PcaPayload payload;
  payload.directions = described->directions;
  payload.mean = code_rows(planar(mean, channels), channels, texels, shape.texels);
  for (std::uint32_t k = 0; k < shape.rank; ++k) {
    Eigen::VectorXf image = svd.left.col(k), weights = svd.right.col(k);
    // The largest pixel is 1, so that half floats and bytes see the same range whatever the material.
    const float largest = image.cwiseAbs().maxCoeff();
    image /= largest;
    weights *= largest;
    payload.images.push_back(
        code_rows(planar({image.data(), mean.size()}, channels), channels, texels, shape.texels));
    payload.weights.push_back(code_rows({weights.data(), static_cast<std::size_t>(weights.size())}, 1,
                                        dataset.info().pairs.size(), shape.tables));
  }

  FitResult result;
  result.chunks = pca_write(described->head, shape, payload);
  result.meta["pca.seed"] = std::to_string(settings.seed);
  double left_out = svd.total_energy;
  for (const double e : svd.energy) left_out -= e;
  const double rows = static_cast<double>(mean.size()) * static_cast<double>(dataset.info().pairs.size());
  result.report = {{"rank", std::to_string(shape.rank)},
                   {"svd_passes", std::to_string(svd.passes)},
                   {"svd_rmse", fmt::format("{:.6g}", std::sqrt(std::max(left_out, 0.0) / rows))}};
  return result;
}

}  // namespace btfc
