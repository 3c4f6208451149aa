// Alternating codes round the middle of the range: the mean and the variance are known exactly.
#include "tests/extremes/accumulations.h"

#include <algorithm>
#include <cmath>

#include "encoder/fields/neighbour_moments.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/linear/truncated_svd.h"
#include "encoder/metrics/dataset_metrics.h"
#include "encoder/models/gm_em.h"
#include "encoder/models/gm_samples.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

double off(double found, double wanted) { return std::fabs(found / wanted - 1); }

// Codes `low` and low + 1 in turn, as a chequerboard of texels and pairs.
Dataset chequered(std::uint64_t samples, std::uint16_t low) {
  const std::vector<Direction> some = rings(2);
  const auto side = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(samples) / 361)) / 2 * 2;
  Result<Dataset> set = Dataset::create(btf_info(side, side, 1, SampleType::unorm16, some, some), "");
  std::vector<std::uint16_t> codes(set->info().image_samples());
  for (std::size_t pair = 0; pair < set->info().pairs.size(); ++pair) {
    for (std::size_t i = 0; i < codes.size(); ++i)
      codes[i] = static_cast<std::uint16_t>(low + ((i + i / side + pair) & 1));
    set->write_image(pair, codes);
  }
  return std::move(*set);
}

double samples_of(const Dataset& set) {
  return static_cast<double>(set.info().image_samples() * set.info().pairs.size());
}

// c + e u_i v_j with u, v of signs: energy n m (c^2 + e^2) where u and v add up to nothing, and two values.
Accumulation svd(std::uint64_t samples) {
  constexpr double kConstant = 0.5, kOffset = 0x1p-10;
  RowBlocks stream;
  stream.columns = 1000;
  stream.rows = samples / stream.columns / 2 * 2;
  stream.block_rows = rows_per_block(stream.columns);
  stream.read = [](std::size_t first, Matrix& block) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      const bool odd_row = ((first + static_cast<std::size_t>(r)) & 1) != 0;
      for (Eigen::Index c = 0; c < block.cols(); ++c)
        block(r, c) = static_cast<float>(kConstant + (odd_row == ((c & 1) != 0) ? kOffset : -kOffset));
    }
  };
  SvdOptions options;
  const TruncatedSvd found = truncated_svd(stream, 2, options);
  const double n = static_cast<double>(stream.rows) * static_cast<double>(stream.columns);
  double error = off(found.total_energy, n * (kConstant * kConstant + kOffset * kOffset));
  if (found.energy.size() != 2)
    return {"pca pcarf lpca plm", "energies of a stream of rows", "of the energy", 1, 1e-5, n};
  error = std::max({error, off(found.energy[0], n * kConstant * kConstant)});
  return {"pca pcarf lpca plm", "energies of a stream of rows", "of the energy", error, 1e-5, n};
}

// The same once the mean of each row is off, as pca's rows are.
Accumulation centred_svd(const Dataset& set) {
  const RowBlocks rows = image_rows(set, true);
  const TruncatedSvd found = truncated_svd(rows, 1, {});
  const double n = static_cast<double>(rows.rows) * static_cast<double>(rows.columns), e = 0.5 / 65535;
  // 361 pairs: one more of one code than of the other.
  const double odd = 1 / static_cast<double>(rows.columns);
  return {"pca pcarf",
          "energy of rows less their means",
          "of the variance",
          off(found.total_energy, n * e * e * (1 - odd * odd)),
          1e-3,
          n};
}

Accumulation mean_images(const Dataset& set, std::uint16_t low) {
  const std::vector<float> means = mean_image(set);
  double error = 0;
  for (const float mean : means) error = std::max(error, off(static_cast<double>(mean), (low + 0.5) / 65535));
  return {"pca pcarf lpca", "mean image", "of the mean", error, 1e-6 + 0.5 / 361 / low, samples_of(set)};
}

std::vector<Accumulation> mixture(const Dataset& set, std::uint16_t low) {
  GmSamples samples = gm_samples(set);
  const std::vector<float> table = gm_mean_table(samples);
  double error = 0;
  for (const float mean : table) error = std::max(error, off(static_cast<double>(mean), (low + 0.5) / 65535));
  samples.mean = table;
  GmEmMixture one;
  one.components = one.channels = 1;
  one.weight = {1};
  one.mean = {0.5 * samples.width, 0.5 * samples.height, 0, 0, 0, 0, 0};
  one.spread = {1.0 * samples.width, 1.0 * samples.height, 1, 1, 1, 1, 1.0 / 65535};
  const GmEmSums sums = gm_em_pass(samples, one, {});
  const GmEmMixture next = gm_em_maximise(one, sums, {});
  // x is uniform over n texels: (n^2 - 1) / 12.
  const double n = samples.width, x = std::sqrt((n * n - 1) / 12);
  const double count = samples_of(set);
  return {{"gm", "mean BRDF", "of the mean", error, 1e-6, count},
          {"gm", "samples of a component", "of their number",
           off(sums.sum[0], static_cast<double>(samples.count())), 1e-6, count},
          {"gm", "spread over x", "of the spread", off(next.spread[0], x), 1e-6, count},
          // Values of codes are binary32: at the middle of the range one step is 512 of their last places.
          {"gm", "spread of a colour", "of the spread", off(next.spread[6], 0.5 / 65535), 2e-3, count}};
}

Accumulation pooled(std::uint64_t samples) {
  const Dataset a = chequered(samples, 32768), b = chequered(samples, 32769);
  DatasetMetricOptions options;
  options.measures.ssim = options.measures.mae_lab = options.measures.flip = false;
  const Result<DatasetMetrics> found = compare_datasets(a, b, options);
  const double wanted = 255.0 / 65535;
  return {"all",         "pooled error of `compare`",
          "of the RMSE", found ? off(found->all.rmse_8bit, wanted) : 1,
          2e-3,          samples_of(a)};
}

std::vector<Accumulation> fields(std::uint64_t samples) {
  // In doubles, and far from 0: what a level's plane is not, but what its sums should stand.
  constexpr double kConstant = 1.0 / 3, kOffset = 0x1p-24;
  // A plane is held whole: 2 GiB of doubles.
  const double most = static_cast<double>(std::min(samples, std::uint64_t{1} << 28));
  const auto side = static_cast<std::uint32_t>(std::sqrt(most)) / 2 * 2;
  FieldPlane plane;
  plane.width = plane.height = side;
  plane.values.resize(std::size_t{side} * side);
  for (std::size_t i = 0; i < plane.values.size(); ++i)
    plane.values[i] = kConstant + (((i + i / side) & 1) != 0 ? kOffset : -kOffset);
  const double mean = mean_of(plane);
  std::vector<Accumulation> out = {{"car gmrf car3d", "mean of a plane", "of the offsets",
                                    std::fabs(mean - kConstant) / kOffset, 1e-6,
                                    static_cast<double>(plane.values.size())}};
  // A neighbourhood's 41 x 41 moments are the slow part.
  plane.width = plane.height = std::min(side, 4000u);
  plane.values.resize(std::size_t{plane.width} * plane.height);
  for (std::size_t i = 0; i < plane.values.size(); ++i)
    plane.values[i] = kConstant + (((i + i / plane.width) & 1) != 0 ? kOffset : -kOffset);
  const NeighbourMoments m = neighbour_moments(std::span(&plane, 1), Neighbourhood::causal, true);
  const auto own = m.own();
  out.push_back({"car gmrf car3d", "variance of a plane's texels", "of the variance",
                 off(m.moments(own, own), kOffset * kOffset), 1e-6,
                 static_cast<double>(plane.values.size())});
  return out;
}

}  // namespace

std::vector<Accumulation> accumulations(std::uint64_t samples) {
  constexpr std::uint16_t kMiddle = 32768;
  std::vector<Accumulation> all = {svd(samples)};
  {
    const Dataset set = chequered(samples, kMiddle);
    all.push_back(centred_svd(set));
    all.push_back(mean_images(set, kMiddle));
    for (const Accumulation& a : mixture(set, kMiddle)) all.push_back(a);
  }
  for (const Accumulation& a : fields(samples)) all.push_back(a);
  all.push_back(pooled(samples));
  return all;
}

}  // namespace btfc::test
