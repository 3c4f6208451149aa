// Synthesis strip by strip. A strip is one row of patches joined from left to right; the texture is the
// strips joined from top to bottom. That is the composite of spec/models/patch.md section 4, read row-wise:
// step a makes the strip, steps b and c (quilting) or the last lerp (liang) join it with the strip above.
// Kept in this form, what is synthesised is what a decoder will see, at every moment of the synthesis.
#include "encoder/models/patch_synthesis.h"

#include <algorithm>

#include "encoder/models/patch_cut.h"
#include "encoder/models/patch_features.h"
#include "encoder/models/patch_search.h"
#include "shaders/models/patch.h"

namespace btfc {
namespace {

// One row of patches: w_B rows of the texture's full width, for every map.
struct Strip {
  std::vector<std::vector<std::uint16_t>> maps;
  std::vector<std::uint8_t> above;  // quilting, rows 0 … w_E-1: 1 where the strip above shows

  Strip(std::span<const Image> samples, std::size_t width, std::size_t size, std::size_t overlap)
      : above(width * overlap) {
    for (const Image& sample : samples) maps.emplace_back(width * size * sample.channels);
  }
};

// splitmix64 of a counter: the choice of patch p depends on seed and p alone.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) {
  std::uint64_t z = seed * 0x9e3779b97f4a7c15u + (counter + 1) * 0xd1b54a32d192ed03u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

class Synthesis {
 public:
  Synthesis(const PatchShape& shape, std::span<const Image> samples, const SynthesisSettings& settings)
      : s_(shape),
        samples_(samples),
        settings_(settings),
        tables_(samples),
        match_(match_image(tables_, samples)),
        width_(shape.full_width()),
        strip_(samples, width_, shape.size, shape.overlap),
        before_(strip_) {
    recipe_.positions.reserve(shape.patches());
    recipe_.cuts_v.resize(shape.cuts_v() * shape.size);
    recipe_.cuts_h.resize(shape.cuts_h() * shape.size);
  }

  PatchRecipe run(const RowSink& sink) {
    for (std::uint32_t j = 0; j < s_.count_y; ++j) {
      for (std::uint32_t i = 0; i < s_.count_x; ++i) {
        const PatchPosition at = choose(i, j);
        recipe_.positions.push_back(at);
        paste(i, j, at);
        if (settings_.progress) settings_.progress(recipe_.positions.size(), s_.patches());
      }
      if (sink) emit(j, sink);
      std::swap(strip_, before_);
    }
    return std::move(recipe_);
  }

 private:
  // Codes of map m that the texture shows at (x, v) of strip j while the strip is being made.
  void shown(std::size_t m, std::size_t x, std::uint32_t v, std::uint32_t j, std::uint16_t* codes) const {
    const std::size_t channels = samples_[m].channels;
    const std::uint16_t* here = &strip_.maps[m][(std::size_t{v} * width_ + x) * channels];
    const bool in_above = j > 0 && v < s_.overlap;
    if (!in_above) {
      std::copy_n(here, channels, codes);
      return;
    }
    const std::uint16_t* up = &before_.maps[m][(std::size_t{v + s_.step()} * width_ + x) * channels];
    if (s_.blend == PatchBlend::quilting) {
      std::copy_n(strip_.above[v * width_ + x] ? up : here, channels, codes);
      return;
    }
    const std::uint32_t weight = patch_weight(v, s_.overlap);
    for (std::size_t c = 0; c < channels; ++c) codes[c] = lerp(m, up[c], here[c], weight);
  }

  std::uint16_t lerp(std::size_t m, std::uint16_t a, std::uint16_t b, std::uint32_t weight) const {
    return static_cast<std::uint16_t>(patch_lerp_code(static_cast<uint>(samples_[m].type), a, b, weight));
  }

  // What the texture shows in the boundary zone of patch (i, j), before that patch is pasted. Right of the
  // left overlap strip j is still empty, and the strip above shows.
  void shown_values(std::uint32_t i, std::uint32_t j, std::uint32_t u, std::uint32_t v,
                    std::int16_t* values) const {
    const std::size_t x = std::size_t{i} * s_.step() + u;
    const bool strip_begun = i > 0 && u < s_.overlap;
    for (std::size_t m = 0; m < samples_.size(); ++m) {
      std::uint16_t codes[4];
      if (strip_begun) {
        shown(m, x, v, j, codes);
      } else {
        const std::size_t channels = samples_[m].channels;
        std::copy_n(&before_.maps[m][(std::size_t{v + s_.step()} * width_ + x) * channels], channels, codes);
      }
      for (std::size_t c = 0; c < samples_[m].channels; ++c) *values++ = tables_(m, codes[c]);
    }
  }

  BoundaryZone zone_of(std::uint32_t i, std::uint32_t j) const {
    BoundaryZone zone;
    zone.length.resize(s_.size);
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      zone.length[v] = j > 0 && v < s_.overlap ? s_.size : i > 0 ? s_.overlap : 0;
      for (std::uint32_t u = 0; u < zone.length[v]; ++u) {
        zone.values.resize(zone.values.size() + match_.channels);
        shown_values(i, j, u, v, &zone.values[zone.values.size() - match_.channels]);
      }
    }
    return zone;
  }

  PatchPosition choose(std::uint32_t i, std::uint32_t j) {
    const std::uint64_t bits = random_bits(settings_.seed, recipe_.positions.size());
    // floor(bits / 2^32 * count) with the upper 32 bits; count is below 2^32.
    const auto pick = [&](std::uint64_t count) { return (bits >> 32) * count >> 32; };
    if (i == 0 && j == 0) {
      const std::uint32_t columns = s_.sample_width - s_.size + 1, rows = s_.sample_height - s_.size + 1;
      const std::uint64_t n = pick(std::uint64_t{columns} * rows);
      return {static_cast<std::uint32_t>(n % columns), static_cast<std::uint32_t>(n / columns)};
    }
    zone_ = zone_of(i, j);
    const Candidates candidates = settings_.plain_search
                                      ? find_candidates_plain(match_, s_.size, zone_, settings_.tau)
                                      : find_candidates(match_, s_.size, zone_, settings_.tau);
    return candidates[pick(candidates.size())];
  }

  // Squared error between the texture and the patch at `at`, at local (u, v) of the boundary zone.
  std::uint64_t error_at(const PatchPosition& at, std::size_t zone_begin, std::uint32_t u,
                         std::uint32_t v) const {
    const std::int16_t* shown_value = &zone_.values[zone_begin + std::size_t{u} * match_.channels];
    const std::int16_t* patch = match_.row(at.x + u, at.y + v);
    std::uint64_t sum = 0;
    for (std::uint32_t c = 0; c < match_.channels; ++c) {
      const std::int32_t difference = shown_value[c] - patch[c];
      sum += static_cast<std::uint64_t>(difference * difference);
    }
    return sum;
  }

  // The L as two cuts: a vertical one over the left overlap, a horizontal one over the upper.
  void cut(std::uint32_t i, std::uint32_t j, const PatchPosition& at, std::vector<std::uint16_t>& vertical,
           std::vector<std::uint16_t>& horizontal) const {
    std::vector<std::uint64_t> left(std::size_t{s_.overlap} * s_.size), upper(left.size());
    std::size_t begin = 0;
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      for (std::uint32_t u = 0; u < zone_.length[v]; ++u) {
        const std::uint64_t error = error_at(at, begin, u, v);
        if (u < s_.overlap) left[std::size_t{v} * s_.overlap + u] = error;
        if (v < s_.overlap) upper[std::size_t{u} * s_.overlap + v] = error;
      }
      begin += std::size_t{zone_.length[v]} * match_.channels;
    }
    if (i > 0) vertical = minimum_error_cut(left, s_.overlap, s_.size);
    if (j > 0) horizontal = minimum_error_cut(upper, s_.overlap, s_.size);
  }

  void paste(std::uint32_t i, std::uint32_t j, const PatchPosition& at) {
    std::vector<std::uint16_t> vertical, horizontal;
    if (s_.blend == PatchBlend::quilting && (i > 0 || j > 0)) {
      cut(i, j, at, vertical, horizontal);
      const auto keep = [&](std::vector<std::uint16_t>& all, std::uint64_t number,
                            const std::vector<std::uint16_t>& one) {
        std::copy(one.begin(), one.end(), all.begin() + static_cast<std::ptrdiff_t>(number * s_.size));
      };
      if (i > 0) keep(recipe_.cuts_v, std::uint64_t{j} * (s_.count_x - 1) + i - 1, vertical);
      if (j > 0) keep(recipe_.cuts_h, std::uint64_t{j - 1} * s_.count_x + i, horizontal);
    }
    const std::size_t left = std::size_t{i} * s_.step();
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      for (std::uint32_t u = 0; u < s_.size; ++u) {
        const bool in_left = i > 0 && u < s_.overlap;
        if (in_left && s_.blend == PatchBlend::quilting && u < vertical[v]) continue;  // the left patch stays
        for (std::size_t m = 0; m < samples_.size(); ++m) {
          const std::size_t channels = samples_[m].channels;
          const std::uint16_t* from = &samples_[m].codes[samples_[m].index(at.x + u, at.y + v, 0)];
          std::uint16_t* to = &strip_.maps[m][(std::size_t{v} * width_ + left + u) * channels];
          const bool blended = in_left && s_.blend == PatchBlend::liang;
          const std::uint32_t weight = blended ? patch_weight(u, s_.overlap) : 256;
          for (std::size_t c = 0; c < channels; ++c)
            to[c] = blended ? lerp(m, to[c], from[c], weight) : from[c];
        }
        if (s_.blend == PatchBlend::quilting && j > 0 && v < s_.overlap) {
          strip_.above[v * width_ + left + u] = v < horizontal[u] ? 1 : 0;
        }
      }
    }
  }

  // The rows of strip j that no later strip touches.
  void emit(std::uint32_t j, const RowSink& sink) const {
    const std::uint32_t rows = j + 1 == s_.count_y ? s_.size : s_.step();
    std::vector<std::vector<std::uint16_t>> row;
    std::vector<const std::uint16_t*> view;
    for (const Image& sample : samples_) row.emplace_back(width_ * sample.channels);
    for (const auto& r : row) view.push_back(r.data());
    for (std::uint32_t v = 0; v < rows; ++v) {
      for (std::size_t m = 0; m < samples_.size(); ++m) {
        for (std::size_t x = 0; x < width_; ++x) shown(m, x, v, j, &row[m][x * samples_[m].channels]);
      }
      sink(j * s_.step() + v, view);
    }
  }

  const PatchShape& s_;
  std::span<const Image> samples_;
  const SynthesisSettings& settings_;
  MatchTables tables_;
  MatchImage match_;
  std::size_t width_;  // of the whole texture
  Strip strip_, before_;
  BoundaryZone zone_;
  PatchRecipe recipe_;
};

}  // namespace

PatchRecipe synthesize_patches(const PatchShape& shape, std::span<const Image> samples,
                               const SynthesisSettings& settings, const RowSink& sink) {
  return Synthesis(shape, samples, settings).run(sink);
}

}  // namespace btfc
