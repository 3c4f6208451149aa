// What every clustering of a matrix' rows needs, whatever stands for a cluster: rows to begin with, and rows
// for clusters that lost theirs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "encoder/linear/matrix.h"

namespace btfc {

struct RowClusters {
  std::vector<std::uint16_t> cluster;  // of each row
  std::vector<float> error;            // squared distance of each row from what stands for its cluster
};

// k-means++ (Arthur, Vassilvitskii 2007): each next row is drawn by its squared distance to the nearest of
// those before, times its weight where there are weights. uniform gives numbers of 0 <= u < 1. A row may come
// twice only where there are fewer different ones than asked for.
std::vector<std::size_t> spread_rows(const Matrix& rows, std::size_t count,
                                     const std::function<double()>& uniform,
                                     std::span<const double> weights = {});

// Gives each empty cluster the row with the largest error of those whose cluster has others. At least as many
// rows as clusters.
void fill_empty(RowClusters& found, std::size_t clusters);

}  // namespace btfc
