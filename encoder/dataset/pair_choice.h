// A part of a data set's pairs: which of them count for a purpose, and how much.
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

struct PairChoice {
  std::vector<std::size_t> pairs;  // numbers in DatasetInfo::pairs, ascending
  std::vector<double> weights;     // of those pairs, as in DatasetInfo; empty: all alike
};

// All of them, as much as they count.
PairChoice all_pairs_of(const DatasetInfo& all);

// Chooses by directions and pairs alone, so that images of others need not be read.
using ChoosePairs = std::function<Result<PairChoice>(const DatasetInfo& all)>;

// The set of the chosen pairs; directions without a pair are left out, the others keep their order.
DatasetInfo chosen_info(const DatasetInfo& all, const PairChoice& choice);

}  // namespace btfc
