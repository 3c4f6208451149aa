// Expanding by two.
#include "format/models/field_collapse.h"

#include <algorithm>
#include <bit>

#include "format/models/field_synthesis.h"

namespace btfc {
namespace {

std::int64_t half(std::int64_t v) { return v >> 1; }

// out += w0 a + w1 b + w2 c, of rows.
void weigh_rows(const float* a, const float* b, const float* c, bool odd, std::size_t count, float* out) {
  if (odd) {
    for (std::size_t i = 0; i < count; ++i) out[i] = 0.5f * b[i] + 0.5f * c[i];
  } else {
    for (std::size_t i = 0; i < count; ++i) out[i] = 0.125f * a[i] + 0.75f * b[i] + 0.125f * c[i];
  }
}

}  // namespace

void field_band_values(const LoadedItem& item, const FieldParams& p, std::uint32_t level,
                       std::span<const std::uint32_t> subspaces, const FieldWindow& window, float* out) {
  if (static_cast<FieldKind>(p.kind) != FieldKind::gmrf) {
    field_synthesise(field_band_of_words(item, p, level), subspaces, window, out);
    return;
  }
  const std::uint32_t* record = item.words[0].data() + p.level_word + FIELD_LEVEL_WORDS * level;
  const std::uint32_t side = record[0];
  for (const std::uint32_t k : subspaces) {
    for (std::uint32_t f = 0; f < p.all_channels; ++f) {
      const std::uint32_t* torus =
          item.words[1].data() + record[1] + (std::size_t{k} * p.all_channels + f) * record[2];
      for (std::uint32_t y = 0; y < window.height; ++y) {
        const std::uint32_t* row = torus + (static_cast<std::uint64_t>(window.y + y) & (side - 1)) * side;
        for (std::uint32_t x = 0; x < window.width; ++x)
          *out++ = std::bit_cast<float>(row[static_cast<std::uint64_t>(window.x + x) & (side - 1)]);
      }
    }
  }
}

FieldWindow field_coarse_window(const FieldWindow& fine) {
  const auto axis = [](std::int64_t first, std::uint32_t count) {
    const std::int64_t begin = half(first) - 1, end = half(first + count - 1) + 2;
    return std::pair(begin, static_cast<std::uint32_t>(end - begin));
  };
  const auto [x, width] = axis(fine.x, fine.width);
  const auto [y, height] = axis(fine.y, fine.height);
  return {x, y, width, height};
}

void field_expand_add(const float* coarse, const FieldWindow& cw, const FieldWindow& fw, float* fine) {
  const auto columns = static_cast<std::size_t>(half(fw.x + fw.width - 1) + 1 - (half(fw.x) - 1) + 1);
  const auto first = static_cast<std::size_t>(half(fw.x) - 1 - cw.x);
  std::vector<float> row(columns);
  for (std::uint32_t y = 0; y < fw.height; ++y) {
    const std::int64_t at = fw.y + y;
    const float* middle = coarse + static_cast<std::size_t>(half(at) - cw.y) * cw.width + first;
    weigh_rows(middle - cw.width, middle, middle + cw.width, (at & 1) != 0, columns, row.data());
    float* to = fine + std::size_t{y} * fw.width;
    const float* c = row.data() + 1;
    std::uint32_t x = 0;
    if ((fw.x & 1) != 0) {
      to[x++] += 0.5f * c[0] + 0.5f * c[1];
      ++c;
    }
    // In pairs, an even and an odd texel.
    const std::uint32_t pairs = (fw.width - x) / 2;
    float* even = to + x;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      even[2 * i] += 0.125f * c[static_cast<std::ptrdiff_t>(i) - 1] + 0.75f * c[i] + 0.125f * c[i + 1];
      even[2 * i + 1] += 0.5f * c[i] + 0.5f * c[i + 1];
    }
    if ((fw.width - x) % 2 == 1)
      even[2 * pairs] +=
          0.125f * c[static_cast<std::ptrdiff_t>(pairs) - 1] + 0.75f * c[pairs] + 0.125f * c[pairs + 1];
  }
}

void field_deviations(const BtfcWords& words, const FieldParams& p, std::uint32_t subspace,
                      std::uint32_t smoothest, const float* factors, std::size_t plane, std::size_t count,
                      float* out) {
  const std::uint32_t d = p.all_channels;
  const uint basis = p.subspace_word + subspace * field_record_words(p) + d;
  std::fill_n(out, count * d, 0.0f);
  std::vector<float> values(count);
  for (std::uint32_t f = 0; f < d; ++f) {
    const uint factor = field_factor_word(p, subspace, f);
    for (std::size_t t = 0; t < count; ++t)
      values[t] = field_marginal(words, p, factor, factors[f * plane + t], smoothest);
    // The channels of car3d are its factors.
    const bool own = p.kind == FIELD_CAR3D;
    for (std::uint32_t c = own ? f : 0; c < (own ? f + 1 : d); ++c) {
      const float weight = own ? 1.0f : field_number(words, basis + c * d + f);
      for (std::size_t t = 0; t < count; ++t) out[t * d + c] += weight * values[t];
    }
  }
}

std::vector<float> field_collapse(const LoadedItem& item, const FieldParams& p, std::uint32_t level,
                                  std::uint32_t smoothest, std::span<const std::uint32_t> subspaces,
                                  const FieldWindow& window) {
  const std::size_t planes = subspaces.size() * p.all_channels;
  std::vector<float> out(planes * window.texels());
  if (level >= smoothest) field_band_values(item, p, level, subspaces, window, out.data());
  if (level + 1 == p.levels) return out;
  const FieldWindow wider = field_coarse_window(window);
  const std::vector<float> coarse = field_collapse(item, p, level + 1, smoothest, subspaces, wider);
  for (std::size_t i = 0; i < planes; ++i)
    field_expand_add(coarse.data() + i * wider.texels(), wider, window, out.data() + i * window.texels());
  return out;
}

}  // namespace btfc
