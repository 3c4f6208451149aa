// A cheap look at all windows, then a small synthesis from the best ones.
#include "encoder/models/patch_sample.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "encoder/metrics/texture_statistics.h"
#include "encoder/models/patch_joins.h"

namespace btfc {
namespace {

constexpr std::uint32_t kWindowsASide = 7;
constexpr std::size_t kSyntheses = 6;

// Evenly from 0 to room, at most `most` places.
std::vector<std::uint32_t> places(std::uint32_t room, std::uint32_t most) {
  const std::uint32_t count = std::min(room, most - 1) + 1;
  std::vector<std::uint32_t> out(count);
  for (std::uint32_t i = 1; i < count; ++i) {
    out[i] = static_cast<std::uint32_t>(std::uint64_t{room} * i / (count - 1));
  }
  return out;
}

std::vector<SampleWindow> windows_of(const Image& image, std::uint32_t width, std::uint32_t height) {
  const std::uint32_t room_x = image.width - width, room_y = image.height - height;
  const std::uint32_t in_a_row = kWindowsASide * kWindowsASide;
  std::vector<SampleWindow> out;
  for (const std::uint32_t y : places(room_y, room_x == 0 ? in_a_row : kWindowsASide)) {
    for (const std::uint32_t x : places(room_x, room_y == 0 ? in_a_row : kWindowsASide)) {
      out.push_back({x, y, width, height});
    }
  }
  return out;
}

std::vector<Image> crops(std::span<const NamedImage> maps, const SampleWindow& w) {
  std::vector<Image> out;
  for (const NamedImage& map : maps) out.push_back(crop(map.image, w.x, w.y, w.width, w.height));
  return out;
}

// The score without seams.
SampleScore score_of(std::span<const TextureStatistics> input, std::span<const Image> maps,
                     std::uint32_t block) {
  SampleScore score;
  const double count = static_cast<double>(maps.size());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const TextureStatistics statistics = texture_statistics(maps[m], block);
    score.gradient += std::fabs(std::log(gradient_kept(input[m], statistics))) / count;
    score.spectrum += spectrum_distance(input[m].spectrum, statistics.spectrum) / count;
    score.colour += colour_distance(input[m], statistics) / count;
  }
  return score;
}

// The shape of a trial: as many patches as cover twice the sample, though not more than asked for.
PatchShape trial_shape(const PatchShape& shape) {
  PatchShape trial = shape;
  trial.wraps = false;
  trial.stored_blocks = 0;
  const auto count = [&](std::uint32_t side, std::uint32_t most) {
    return std::min(most, (2 * side - trial.overlap + trial.step() - 1) / trial.step());
  };
  trial.count_x = count(shape.sample_width, shape.count_x);
  trial.count_y = count(shape.sample_height, shape.count_y);
  return trial;
}

SampleScore trial_score(std::span<const TextureStatistics> input, std::span<const Image> samples,
                        const PatchShape& shape, const SynthesisSettings& settings, std::uint32_t block) {
  Head head;
  head.model = ModelId::patch;
  head.width = static_cast<std::uint32_t>(shape.full_width());
  head.height = static_cast<std::uint32_t>(shape.full_height());
  std::vector<Image> textures(samples.begin(), samples.end());
  for (Image& texture : textures) {
    texture.width = head.width;
    texture.height = head.height;
    texture.codes.resize(std::size_t{head.width} * head.height * texture.channels);
  }
  const PatchRecipe recipe = synthesize_patches(
      shape, samples, settings, [&](std::uint32_t y, std::span<const std::uint16_t* const> rows) {
        for (std::size_t m = 0; m < rows.size(); ++m) {
          Image& texture = textures[m];
          std::copy_n(rows[m], std::size_t{texture.width} * texture.channels,
                      &texture.codes[texture.index(0, y, 0)]);
        }
      });
  SampleScore score = score_of(input, textures, block);
  const JoinMask joins = patch_joins(head, shape, recipe);
  for (const Image& texture : textures) {
    const double ratio = join_gradients(texture, joins).seam_ratio().value_or(1);
    score.seams += std::fmax(0, std::log(ratio)) / static_cast<double>(textures.size());
  }
  return score;
}

}  // namespace

SampleChoice choose_sample(std::span<const NamedImage> maps, const PatchShape& shape,
                           const SynthesisSettings& settings) {
  const PatchShape trial = trial_shape(shape);
  // One patch may be smaller than the sample.
  const std::uint32_t block = std::min(spectrum_block(shape.sample_width, shape.sample_height),
                                       spectrum_block(static_cast<std::uint32_t>(trial.full_width()),
                                                      static_cast<std::uint32_t>(trial.full_height())));
  std::vector<TextureStatistics> input;
  for (const NamedImage& map : maps) input.push_back(texture_statistics(map.image, block));

  const std::vector<SampleWindow> windows =
      windows_of(maps[0].image, shape.sample_width, shape.sample_height);
  std::vector<double> looks(windows.size());
  tbb::parallel_for(std::size_t{0}, windows.size(), [&](std::size_t i) {
    looks[i] = score_of(input, crops(maps, windows[i]), block).total();
  });
  std::vector<std::size_t> order(windows.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return looks[a] < looks[b]; });

  SynthesisSettings quiet = settings;
  quiet.progress = {};
  SampleChoice choice;
  choice.windows = windows.size();
  choice.syntheses = std::min(kSyntheses, windows.size());
  for (std::size_t i = 0; i < choice.syntheses; ++i) {
    const SampleWindow& window = windows[order[i]];
    const SampleScore score = trial_score(input, crops(maps, window), trial, quiet, block);
    if (i > 0 && score.total() >= choice.score.total()) continue;
    choice.window = window;
    choice.score = score;
  }
  return choice;
}

}  // namespace btfc
