// Codes -> values, a run of texels at a time.
#include "encoder/linear/dataset_rows.h"

#include <algorithm>
#include <span>

namespace btfc {
namespace {

// All samples of texels first … first+count-1 (numbered in rows): codes[(t pairs + pair) channels + channel].
std::vector<std::uint16_t> read_run(const Dataset& dataset, std::size_t first, std::size_t count) {
  const DatasetInfo& info = dataset.info();
  const std::size_t texel = info.pairs.size() * info.channels.size();
  std::vector<std::uint16_t> codes(count * texel);
  for (std::size_t done = 0; done < count;) {
    const std::size_t x = (first + done) % info.width, y = (first + done) / info.width;
    const std::size_t run = std::min(count - done, info.width - x);
    dataset.read_texels(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                        static_cast<std::uint32_t>(run), std::span(codes).subspan(done * texel, run * texel));
    done += run;
  }
  return codes;
}

// The mean of a row over pairs by their weights, which have the mean 1.
float mean_over_pairs(const Matrix& block, Eigen::Index row, const std::vector<double>& weights) {
  if (weights.empty()) return static_cast<float>(block.row(row).cast<double>().mean());
  const Eigen::Map<const Eigen::RowVectorXd> w(weights.data(), as_index(weights.size()));
  return static_cast<float>(block.row(row).cast<double>().cwiseProduct(w).sum() / w.sum());
}

}  // namespace

std::vector<float> value_table(SampleType type) {
  std::vector<float> table(type == SampleType::unorm8 ? 256 : 65536);
  for (std::size_t code = 0; code < table.size(); ++code)
    table[code] = code_value(type, static_cast<std::uint16_t>(code));
  return table;
}

RowBlocks image_rows(const Dataset& dataset, bool centred) {
  const DatasetInfo& info = dataset.info();
  const std::size_t channels = info.channels.size(), pairs = info.pairs.size();
  RowBlocks rows;
  rows.rows = std::size_t{info.width} * info.height * channels;
  rows.columns = pairs;
  rows.block_rows = std::max<std::size_t>(1, rows_per_block(pairs) / channels) * channels;  // whole texels
  rows.read = [&dataset, channels, pairs, centred, table = value_table(info.type)](std::size_t first_row,
                                                                                   Matrix& block) {
    const auto texels = static_cast<std::size_t>(block.rows()) / channels;
    const std::vector<std::uint16_t> codes = read_run(dataset, first_row / channels, texels);
    for (std::size_t t = 0; t < texels; ++t) {
      for (std::size_t p = 0; p < pairs; ++p) {
        for (std::size_t c = 0; c < channels; ++c) {
          block(as_index(t * channels + c), as_index(p)) = table[codes[(t * pairs + p) * channels + c]];
        }
      }
    }
    if (!centred) return;
    for (Eigen::Index r = 0; r < block.rows(); ++r)
      block.row(r).array() -= mean_over_pairs(block, r, dataset.info().weights);
  };
  return rows;
}

RowBlocks abrdf_rows(const Dataset& dataset) {
  const DatasetInfo& info = dataset.info();
  RowBlocks rows;
  rows.rows = std::size_t{info.width} * info.height;
  rows.columns = info.pairs.size() * info.channels.size();
  rows.block_rows = rows_per_block(rows.columns);
  rows.read = [&dataset, table = value_table(info.type)](std::size_t first_row, Matrix& block) {
    const std::vector<std::uint16_t> codes =
        read_run(dataset, first_row, static_cast<std::size_t>(block.rows()));
    for (std::size_t i = 0; i < codes.size(); ++i) block.data()[i] = table[codes[i]];
  };
  return rows;
}

std::vector<double> abrdf_weights(const DatasetInfo& info) {
  std::vector<double> weights;
  for (const double weight : info.weights) weights.insert(weights.end(), info.channels.size(), weight);
  return weights;
}

std::vector<float> mean_image(const Dataset& dataset) {
  const RowBlocks rows = image_rows(dataset, false);
  std::vector<float> mean(rows.rows);
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        for (Eigen::Index r = 0; r < block.rows(); ++r) {
          mean[number * rows.block_rows + static_cast<std::size_t>(r)] =
              mean_over_pairs(block, r, dataset.info().weights);
        }
      },
      [](std::size_t) {});
  return mean;
}

}  // namespace btfc
