// The error of every rectangle under every group of pairs.
#include "encoder/models/gm_score.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "encoder/models/gm_gradient.h"

namespace btfc {

double gm_psnr(const GmSamples& samples, const GmMixture& mixture, std::uint32_t gates) {
  const GmField field = gm_field(mixture, samples.width, samples.height, samples.wraps);
  std::vector<double> squares(samples.groups.size());
  GmGradientOptions options;
  options.gradient = false;
  options.gates = gates;
  tbb::parallel_for(std::size_t{0}, samples.groups.size(), [&](std::size_t g) {
    GmScratch scratch;
    GmSums sums;
    for (std::uint32_t y = 0; y < samples.height; y += kGmTile) {
      for (std::uint32_t x = 0; x < samples.width; x += kGmTile) {
        const GmVisit visit{x,
                            y,
                            std::min(kGmTile, samples.width - x),
                            std::min(kGmTile, samples.height - y),
                            &samples.groups[g],
                            samples.groups[g].pairs};
        gm_add_gradient(field, samples, visit, options, scratch, sums);
      }
    }
    squares[g] = sums.squared_error;
  });
  double sum = 0;
  for (const double s : squares) sum += s;
  return -10 * std::log10(sum / (static_cast<double>(samples.count()) * samples.channels));
}

}  // namespace btfc
