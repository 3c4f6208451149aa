// Renumbering of the directions that stay.
#include "encoder/dataset/pair_choice.h"

#include <numeric>

namespace btfc {
namespace {

// Leaves the directions whose flag is set, and says their new numbers.
std::vector<std::uint32_t> keep(std::vector<Direction>& directions, const std::vector<bool>& used) {
  std::vector<std::uint32_t> number(directions.size());
  std::vector<Direction> kept;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    number[i] = static_cast<std::uint32_t>(kept.size());
    if (used[i]) kept.push_back(directions[i]);
  }
  directions = std::move(kept);
  return number;
}

}  // namespace

PairChoice all_pairs_of(const DatasetInfo& all) {
  PairChoice choice{std::vector<std::size_t>(all.pairs.size()), all.weights};
  std::iota(choice.pairs.begin(), choice.pairs.end(), std::size_t{0});
  return choice;
}

DatasetInfo chosen_info(const DatasetInfo& all, const PairChoice& choice) {
  DatasetInfo info = all;
  std::vector<bool> viewed(all.views.size()), lit(all.lights.size());
  for (const std::size_t p : choice.pairs) {
    viewed[all.pairs[p].view] = true;
    lit[all.pairs[p].light] = true;
  }
  const std::vector<std::uint32_t> view = keep(info.views, viewed), light = keep(info.lights, lit);
  info.pairs.clear();
  for (const std::size_t p : choice.pairs)
    info.pairs.push_back({view[all.pairs[p].view], light[all.pairs[p].light]});
  info.weights = choice.weights;
  return info;
}

}  // namespace btfc
