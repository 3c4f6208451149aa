// Copying images.
#include "tools/dataset_part.h"

#include <numeric>

#include "encoder/dataset/pair_choice.h"

namespace btfc {
Result<Dataset> dataset_part(const Dataset& whole, const std::vector<std::size_t>& pairs,
                             const TexelWindow& window, const std::string& scratch_directory) {
  PairChoice choice{pairs, {}};
  if (!whole.info().weights.empty()) {
    double total = 0;
    for (const std::size_t p : pairs) total += whole.info().weight(p);
    for (const std::size_t p : pairs)
      choice.weights.push_back(whole.info().weight(p) * static_cast<double>(pairs.size()) / total);
  }
  DatasetInfo info = chosen_info(whole.info(), choice);
  info.wraps = info.wraps && window.width == info.width && window.height == info.height;
  info.width = window.width;
  info.height = window.height;
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
