// Quilting: PatchOrigin tells which texel is shown where. Liang: a patch shows all of itself, as far as it
// lies in the texture.
#include "encoder/models/patch_trim.h"

#include <algorithm>

#include "encoder/models/patch_origin.h"

namespace btfc {
namespace {

std::vector<bool> shown_by_quilting(const Head& head, const PatchShape& s, const PatchRecipe& recipe) {
  const PatchOrigin origin = PatchOrigin::of_recipe(head, s, recipe);
  std::vector<bool> shown(std::size_t{s.sample_width} * s.sample_height);
  for (std::uint32_t y = 0; y < head.height; ++y) {
    for (std::uint32_t x = 0; x < head.width; ++x) {
      const PatchPosition at = origin.at(x, y);
      shown[std::size_t{at.y} * s.sample_width + at.x] = true;
    }
  }
  return shown;
}

std::vector<bool> shown_by_liang(const Head& head, const PatchShape& s, const PatchRecipe& recipe) {
  std::vector<bool> shown(std::size_t{s.sample_width} * s.sample_height);
  for (std::size_t p = 0; p < recipe.positions.size(); ++p) {
    const std::uint32_t left = static_cast<std::uint32_t>(p % s.count_x) * s.step();
    const std::uint32_t top = static_cast<std::uint32_t>(p / s.count_x) * s.step();
    const std::uint32_t columns = s.wraps ? s.size : std::min(s.size, head.width - left);
    const std::uint32_t rows = s.wraps ? s.size : std::min(s.size, head.height - top);
    for (std::uint32_t v = 0; v < rows; ++v) {
      const std::size_t first =
          std::size_t{recipe.positions[p].y + v} * s.sample_width + recipe.positions[p].x;
      std::fill_n(shown.begin() + static_cast<std::ptrdiff_t>(first), columns, true);
    }
  }
  return shown;
}

}  // namespace

double trim_sample(const Head& head, PatchShape& s, PatchRecipe& recipe, bool apply) {
  const std::vector<bool> shown =
      s.blend == PatchBlend::quilting ? shown_by_quilting(head, s, recipe) : shown_by_liang(head, s, recipe);
  const double used =
      static_cast<double>(std::count(shown.begin(), shown.end(), true)) / static_cast<double>(shown.size());
  if (!apply) return used;
  std::vector<bool> blocks(std::size_t{s.blocks_x()} * s.blocks_y());
  for (std::size_t q = 0; q < shown.size(); ++q) {
    if (shown[q]) blocks[q / s.sample_width / 4 * s.blocks_x() + q % s.sample_width / 4] = true;
  }
  PatchShape trimmed = s;
  trimmed.stored_blocks = static_cast<std::uint32_t>(std::count(blocks.begin(), blocks.end(), true));
  if (trimmed.stored_blocks == blocks.size() ||
      patch_formula_bits(trimmed, head.maps) >= patch_formula_bits(s, head.maps)) {
    return used;
  }
  s = trimmed;
  recipe.blocks = std::move(blocks);
  return used;
}

}  // namespace btfc
