// Copying images, and renumbering directions.
#include "tools/dataset_part.h"

#include <algorithm>
#include <numeric>
#include <optional>

namespace btfc {
namespace {

// Keeps the directions whose number occurs; numbers become those of the rest.
std::vector<Direction> keep_used(const std::vector<Direction>& all, std::vector<DirectionPair>& pairs,
                                 std::uint32_t DirectionPair::*number) {
  std::vector<std::optional<std::uint32_t>> renumbered(all.size());
  for (const DirectionPair& pair : pairs) renumbered[pair.*number] = 0;
  std::vector<Direction> kept;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!renumbered[i]) continue;
    renumbered[i] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(all[i]);
  }
  for (DirectionPair& pair : pairs) pair.*number = *renumbered[pair.*number];
  return kept;
}

}  // namespace

Result<Dataset> dataset_part(const Dataset& whole, const std::vector<std::size_t>& pairs,
                             const TexelWindow& window, const std::string& scratch_directory) {
  DatasetInfo info = whole.info();
  info.wraps = info.wraps && window.width == info.width && window.height == info.height;
  info.width = window.width;
  info.height = window.height;
  info.pairs.clear();
  info.weights.clear();
  double total = 0;
  for (const std::size_t p : pairs) {
    info.pairs.push_back(whole.info().pairs[p]);
    total += whole.info().weight(p);
  }
  if (!whole.info().weights.empty()) {
    for (const std::size_t p : pairs)
      info.weights.push_back(whole.info().weight(p) * static_cast<double>(pairs.size()) / total);
  }
  info.views = keep_used(info.views, info.pairs, &DirectionPair::view);
  info.lights = keep_used(info.lights, info.pairs, &DirectionPair::light);
  Result<Dataset> part = Dataset::create(info, scratch_directory);
  if (!part) return part.error();
  std::vector<std::uint16_t> codes(whole.info().image_samples()), cut;
  const std::size_t channels = info.channels.size(), row = std::size_t{info.width} * channels;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    whole.read_image(pairs[i], codes);
    cut.clear();
    for (std::uint32_t y = 0; y < window.height; ++y) {
      const auto from =
          codes.begin() +
          static_cast<std::ptrdiff_t>((std::size_t{window.y + y} * whole.info().width + window.x) * channels);
      cut.insert(cut.end(), from, from + static_cast<std::ptrdiff_t>(row));
    }
    part->write_image(i, cut);
  }
  return part;
}

std::vector<std::size_t> spread_pairs(const DatasetInfo& info, std::size_t most) {
  std::size_t step = (info.pairs.size() + most - 1) / most;
  while (step > 1 && std::gcd(step, info.lights.size()) != 1) ++step;
  std::vector<std::size_t> chosen;
  for (std::size_t p = 0; p < info.pairs.size(); p += step) chosen.push_back(p);
  return chosen;
}

std::vector<std::size_t> pairs_of_views(const DatasetInfo& info, std::size_t most) {
  const std::size_t step = (info.views.size() + most - 1) / most;
  std::vector<std::size_t> chosen;
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    if (info.pairs[p].view % step == 0) chosen.push_back(p);
  }
  // Views without pairs may be the only ones that were looked for.
  return chosen.empty() ? spread_pairs(info, 1) : chosen;
}

}  // namespace btfc
