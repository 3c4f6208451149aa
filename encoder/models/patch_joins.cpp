// Joins of a quilted texture from the sample texels that it shows, of a feathered one from its grid.
#include "encoder/models/patch_joins.h"

#include <algorithm>

#include "encoder/models/patch_origin.h"

namespace btfc {
namespace {

JoinMask empty_mask(const Head& head) {
  return {head.width, head.height, std::vector<std::uint8_t>(std::size_t{head.width} * head.height)};
}

JoinMask quilted(const Head& head, const PatchOrigin& origin) {
  JoinMask mask = empty_mask(head);
  std::vector<PatchPosition> here(head.width), below(head.width);
  const auto read = [&](std::uint32_t y, std::vector<PatchPosition>& row) {
    for (std::uint32_t x = 0; x < head.width; ++x) row[x] = origin.at(x, y);
  };
  read(0, here);
  for (std::uint32_t y = 0; y < head.height; ++y) {
    if (y + 1 < head.height) read(y + 1, below);
    for (std::uint32_t x = 0; x < head.width; ++x) {
      std::uint8_t& bits = mask.bits[std::size_t{y} * head.width + x];
      const PatchPosition at = here[x];
      if (x + 1 < head.width && here[x + 1] != PatchPosition{at.x + 1, at.y}) bits |= JoinMask::kRight;
      if (y + 1 < head.height && below[x] != PatchPosition{at.x, at.y + 1}) bits |= JoinMask::kBelow;
    }
    std::swap(here, below);
  }
  return mask;
}

// For each position along a side, whether it lies in an overlap.
std::vector<bool> overlaps(std::uint32_t side, std::uint32_t count, const PatchShape& s) {
  std::vector<bool> in(side);
  for (std::uint32_t x = 0; x < side; ++x) {
    const std::uint32_t i = std::min(x / s.step(), count - 1);
    in[x] = (i > 0 || s.wraps) && x - i * s.step() < s.overlap;
  }
  return in;
}

JoinMask feathered(const Head& head, const PatchShape& s) {
  JoinMask mask = empty_mask(head);
  const auto columns = overlaps(head.width, s.count_x, s), rows = overlaps(head.height, s.count_y, s);
  for (std::uint32_t y = 0; y < head.height; ++y) {
    for (std::uint32_t x = 0; x < head.width; ++x) {
      std::uint8_t& bits = mask.bits[std::size_t{y} * head.width + x];
      const bool in = columns[x] || rows[y];
      if (x + 1 < head.width && (in || columns[x + 1])) bits |= JoinMask::kRight;
      if (y + 1 < head.height && (in || rows[y + 1])) bits |= JoinMask::kBelow;
    }
  }
  return mask;
}

}  // namespace

JoinMask patch_joins(const Head& head, const PatchShape& shape, const PatchRecipe& recipe) {
  if (shape.blend == PatchBlend::liang) return feathered(head, shape);
  return quilted(head, PatchOrigin::of_recipe(head, shape, recipe));
}

Result<JoinMask> patch_file_joins(const LoadedItem& item, ByteView parm) {
  const Result<PatchShape> shape = read_patch_parm(parm, item.head);
  if (!shape) return shape.error();
  if (shape->blend == PatchBlend::liang) return feathered(item.head, *shape);
  return quilted(item.head, PatchOrigin(item, *shape));
}

}  // namespace btfc
