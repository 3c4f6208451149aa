// Data set -> clusters in a reduced space -> a PCA of each cluster in the full one -> chunks.
#include "encoder/models/lpca_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/linear/truncated_svd.h"
#include "encoder/models/lpca_clusters.h"
#include "encoder/run_on_threads.h"
#include "format/models/lpca_payload.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"clusters", "C", "clusters c of texels, 1 to 65536 (default 8)"},
    {"rank", "K", "components k of each cluster beside its mean, 0 to 255 (default 8)"},
    {"precision", "f32|f16|u8", "of texels and tables (default f32)"},
    {"table-precision", "f32|f16|u8", "of the clusters' means and eigenvectors (default: as --precision)"},
    {"iterations", "T", "of the clustering at most, 1 to 1000 (default 30)"},
};

// Clusters are found among the vectors' coordinates in their common leading subspace, pairs by their weights:
// what lies outside it hardly depends on the choice, and an iteration costs a hundredth.
constexpr std::size_t kReducedDimensions = 256;

// The cluster's texels as rows, less their mean.
RowBlocks member_rows(const RowBlocks& all, const std::vector<std::size_t>& members,
                      const Eigen::RowVectorXf& mean) {
  RowBlocks rows;
  rows.rows = members.size();
  rows.columns = all.columns;
  rows.block_rows = rows_per_block(all.columns);
  rows.read = [&](std::size_t first_row, Matrix& block) {
    Matrix row(1, as_index(all.columns));
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      all.read(members[first_row + static_cast<std::size_t>(r)], row);
      block.row(r) = row.row(0) - mean;
    }
  };
  return rows;
}

// Sums in double, blocks in order.
Eigen::RowVectorXf mean_of(const RowBlocks& all, const std::vector<std::size_t>& members) {
  const Eigen::RowVectorXf nothing = Eigen::RowVectorXf::Zero(as_index(all.columns));
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(as_index(all.columns));
  std::vector<Eigen::RowVectorXd> partial(kPartials);
  for_each_block(
      member_rows(all, members, nothing),
      [&](const Matrix& block, std::size_t, std::size_t place) {
        partial[place] = block.cast<double>().colwise().sum();
      },
      [&](std::size_t place) { sum += partial[place]; });
  return (sum / static_cast<double>(members.size())).cast<float>();
}

struct Tables {
  std::vector<float> means;                 // [cluster][channel][pair]
  std::vector<std::vector<float>> vectors;  // [component][cluster][channel][pair]
  std::vector<std::vector<float>> weights;  // [component][texel]
};

// A column (pair, channel) of a cluster -> its rows.
void place(const Eigen::Ref<const Eigen::VectorXf>& column, std::size_t channels, std::size_t cluster,
           std::vector<float>& rows) {
  const auto size = static_cast<std::size_t>(column.size());
  for (std::size_t i = 0; i < size; ++i)
    rows[cluster * size + i % channels * (size / channels) + i / channels] = column(as_index(i));
}

// PCA of every cluster in the full space. weights: of the columns. left_out: squared error by weights.
Tables local_tables(const RowBlocks& all, std::span<const double> weights, const LpcaShape& shape,
                    std::size_t channels, const std::vector<std::uint16_t>& cluster, std::uint64_t seed,
                    double& left_out) {
  const std::size_t size = shape.clusters * all.columns;
  Tables t{std::vector<float>(size), {}, {}};
  t.vectors.assign(shape.rank, std::vector<float>(size));
  t.weights.assign(shape.rank, std::vector<float>(cluster.size()));
  for (std::size_t m = 0; m < shape.clusters; ++m) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      if (cluster[i] == m) members.push_back(i);
    }
    const Eigen::RowVectorXf mean = mean_of(all, members);
    place(mean.transpose(), channels, m, t.means);
    SvdOptions options;
    options.seed = seed;
    const TruncatedSvd svd = weighted_svd(member_rows(all, members, mean), weights,
                                          std::min<std::size_t>(shape.rank, members.size() - 1), options);
    left_out += svd.total_energy;
    for (std::size_t k = 0; k < static_cast<std::size_t>(svd.right.cols()); ++k) {
      left_out -= svd.energy[k];
      const Eigen::VectorXf left = svd.left.col(as_index(k));
      // The largest weight of a cluster is 1: half floats and bytes see the same range in all of them.
      const float largest = left.cwiseAbs().maxCoeff();
      if (largest == 0) continue;
      place(svd.right.col(as_index(k)) * largest, channels, m, t.vectors[k]);
      for (std::size_t i = 0; i < members.size(); ++i) t.weights[k][members[i]] = left(as_index(i)) / largest;
    }
  }
  return t;
}

}  // namespace

const std::span<const OptionSpec> kLpcaFitOptions = kOptions;

Result<FitResult> lpca_fit(const FitInput& input, const FitSettings& settings) {
  Result<LpcaShape> wanted = lpca_shape_from_options(settings.options);
  if (!wanted) return wanted.error();
  LpcaShape& shape = *wanted;
  const auto iterations = parse_u32(settings.options, "iterations", 1, 1000);
  if (!iterations) return iterations.error();
  const DatasetInfo& info = input.dataset->info();
  const Result<DatasetHead> described = dataset_head(info, ModelId::lpca);
  if (!described) return described.error();

  const std::size_t texels = std::size_t{info.width} * info.height, channels = info.channels.size();
  shape.clusters = static_cast<std::uint32_t>(std::min<std::size_t>(shape.clusters, texels));
  shape.rank = static_cast<std::uint32_t>(
      std::min({std::size_t{shape.rank}, texels - shape.clusters, info.pairs.size() * channels}));
  if (const auto fits = read_lpca_parm(described->head, write_lpca_parm(shape)); !fits) return fits.error();

  const RowBlocks all = abrdf_rows(*input.dataset);
  const std::vector<double> weights = abrdf_weights(info);
  LpcaClusters found;
  Tables tables;
  double left_out = 0;
  run_on_threads(settings.threads, [&] {
    SvdOptions reduction;
    reduction.seed = settings.seed;
    reduction.tolerance = 0.05;  // a basis for choosing, not for showing
    const TruncatedSvd reduced =
        truncated_svd(weighted_columns(all, weights), std::min(kReducedDimensions, texels), reduction);
    LpcaClusterOptions options;
    options.clusters = shape.clusters;
    options.rank = shape.rank;
    options.most_iterations = iterations->value_or(30);
    options.seed = settings.seed;
    options.progress = settings.progress;
    found = lpca_clusters(reduced.left, options);
    tables = local_tables(all, weights, shape, channels, found.cluster, settings.seed, left_out);
  });

  LpcaPayload payload;
  payload.directions = described->directions;
  payload.cluster = found.cluster;
  const std::uint64_t rows = shape.clusters * channels;
  payload.means = code_rows(tables.means, rows, info.pairs.size(), shape.tables);
  for (std::uint32_t k = 0; k < shape.rank; ++k) {
    payload.vectors.push_back(code_rows(tables.vectors[k], rows, info.pairs.size(), shape.tables));
    payload.weights.push_back(code_rows(tables.weights[k], 1, texels, shape.texels));
  }
  FitResult result;
  result.chunks = lpca_write(described->head, shape, payload);
  result.meta["lpca.seed"] = std::to_string(settings.seed);
  const double samples = static_cast<double>(texels) * static_cast<double>(all.columns);
  result.report = {{"clusters", std::to_string(shape.clusters)},
                   {"rank", std::to_string(shape.rank)},
                   {"iterations", std::to_string(found.iterations)},
                   {"svd_rmse", fmt::format("{:.6g}", std::sqrt(std::max(left_out, 0.0) / samples))}};
  return result;
}

}  // namespace btfc
