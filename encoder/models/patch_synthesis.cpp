// Synthesis strip by strip. A strip is one row of patches joined from left to right; the texture is the
// strips joined from top to bottom. That is the composite of spec/models/patch.md section 4, read row-wise:
// step a makes the strip, steps b and c (quilting) or the last lerp (liang) join it with the strip above.
// Kept in this form, what is synthesised is what a decoder will see, at every moment of the synthesis.
#include "encoder/models/patch_synthesis.h"

#include <algorithm>

#include "encoder/minimum_cut.h"
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
        planes_(match_),
        width_(shape.full_width()),
        strip_(samples, width_, shape.size, shape.overlap),
        before_(strip_),
        first_(strip_) {
    recipe_.positions.reserve(shape.patches());
    recipe_.cuts_v.resize(shape.cuts_v() * shape.size);
    recipe_.cuts_h.resize(shape.cuts_h() * shape.size);
  }

  PatchRecipe run(const RowSink& sink) {
    for (std::uint32_t j = 0; j < s_.count_y; ++j) {
      for (std::uint32_t i = 0; i < s_.count_x; ++i) {
        const Choice choice = choose(i, j);
        recipe_.positions.push_back(choice.at);
        paste(i, j, choice.at, choice.cuts);
        if (settings_.progress) settings_.progress(recipe_.positions.size(), s_.patches());
      }
      if (s_.wraps && j == 0) first_ = strip_;
      // Of a texture that wraps, the first rows wait for the last strip.
      const std::uint32_t begin = s_.wraps && j == 0 ? s_.overlap : 0;
      const std::uint32_t end = j + 1 == s_.count_y && !s_.wraps ? s_.size : s_.step();
      if (sink) emit(strip_, j, begin, end, sink);
      std::swap(strip_, before_);
    }
    if (s_.wraps) {
      if (s_.blend == PatchBlend::quilting) close_texture();
      if (sink) emit(first_, 0, 0, s_.overlap, sink);
    }
    return std::move(recipe_);
  }

 private:
  bool quilting() const { return s_.blend == PatchBlend::quilting; }
  bool has_above(std::uint32_t j) const { return j > 0 || s_.wraps; }

  // Codes of map m that the texture shows at (x, v) of a strip whose upper neighbour is before_.
  void shown(const Strip& strip, std::size_t m, std::size_t x, std::uint32_t v, bool above,
             std::uint16_t* codes) const {
    const std::size_t channels = samples_[m].channels;
    const std::uint16_t* here = &strip.maps[m][(std::size_t{v} * width_ + x) * channels];
    if (!above || v >= s_.overlap) {
      std::copy_n(here, channels, codes);
      return;
    }
    const std::uint16_t* up = &before_.maps[m][(std::size_t{v + s_.step()} * width_ + x) * channels];
    if (quilting()) {
      std::copy_n(strip.above[v * width_ + x] ? up : here, channels, codes);
      return;
    }
    const std::uint32_t weight = patch_weight(v, s_.overlap);
    for (std::size_t c = 0; c < channels; ++c) codes[c] = lerp(m, up[c], here[c], weight);
  }

  std::uint16_t lerp(std::size_t m, std::uint16_t a, std::uint16_t b, std::uint32_t weight) const {
    return static_cast<std::uint16_t>(patch_lerp_code(static_cast<uint>(samples_[m].type), a, b, weight));
  }

  // Whether the boundary zone of patch (i, j) has what is asked: overlaps with patches that exist already.
  struct Zone {
    bool left, right, above, below;
  };
  Zone zone_of(std::uint32_t i, std::uint32_t j) const {
    return {i > 0, s_.wraps && i > 0 && i + 1 == s_.count_x, j > 0, s_.wraps && j > 0 && j + 1 == s_.count_y};
  }

  // Matching values of what the texture shows at local (u, v) of patch (i, j), before that patch is pasted.
  void shown_values(std::uint32_t i, std::uint32_t j, std::uint32_t u, std::uint32_t v,
                    std::int16_t* values) const {
    const Zone zone = zone_of(i, j);
    const std::size_t x = (std::size_t{i} * s_.step() + u) % width_;
    const bool strip_begun = (zone.left && u < s_.overlap) || (zone.right && u >= s_.step());
    const bool in_above = zone.above && v < s_.overlap;
    for (std::size_t m = 0; m < samples_.size(); ++m) {
      std::uint16_t codes[4];
      if (strip_begun) {
        shown(strip_, m, x, v, zone.above, codes);
      } else {
        const std::size_t channels = samples_[m].channels;
        const Strip& other = in_above ? before_ : first_;
        const std::size_t row = in_above ? v + s_.step() : v - s_.step();
        std::copy_n(&other.maps[m][(row * width_ + x) * channels], channels, codes);
      }
      for (std::size_t c = 0; c < samples_[m].channels; ++c) *values++ = tables_(m, codes[c]);
    }
  }

  BoundaryZone boundary_zone(std::uint32_t i, std::uint32_t j) const {
    const Zone zone = zone_of(i, j);
    BoundaryZone out;
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      if ((zone.above && v < s_.overlap) || (zone.below && v >= s_.step())) {
        out.runs.push_back({v, 0, s_.size});
        continue;
      }
      if (zone.left) out.runs.push_back({v, 0, s_.overlap});
      if (zone.right) out.runs.push_back({v, s_.step(), s_.overlap});
    }
    for (const ZoneRun& run : out.runs) {
      for (std::uint32_t u = run.u; u < run.u + run.length; ++u) {
        out.values.resize(out.values.size() + match_.channels);
        shown_values(i, j, u, run.v, &out.values[out.values.size() - match_.channels]);
      }
    }
    return out;
  }

  std::uint64_t squared_error(const std::int16_t* a, const std::int16_t* b) const {
    std::uint64_t sum = 0;
    for (std::uint32_t c = 0; c < match_.channels; ++c) {
      const std::int32_t difference = a[c] - b[c];
      sum += static_cast<std::uint64_t>(difference * difference);
    }
    return sum;
  }

  // Matching values that a strip holds at (x, v), whatever the strip above shows.
  void strip_values(const Strip& strip, std::size_t x, std::uint32_t v, std::int16_t* values) const {
    for (std::size_t m = 0; m < samples_.size(); ++m) {
      const std::size_t channels = samples_[m].channels;
      const std::uint16_t* codes = &strip.maps[m][(std::size_t{v} * width_ + x) * channels];
      for (std::size_t c = 0; c < channels; ++c) *values++ = tables_(m, codes[c]);
    }
  }

  // A minimum error cut over w_E columns (or rows) and w_B steps along it; shown(a, t) gives what the
  // texture shows a texels into the overlap at step t, patch(a, t) what the patch holds there.
  template <class Shown, class Patch>
  Cut cut(const Shown& shown, const Patch& patch) const {
    std::vector<std::uint64_t> error(std::size_t{s_.overlap} * s_.size);
    for (std::uint32_t t = 0; t < s_.size; ++t) {
      for (std::uint32_t a = 0; a < s_.overlap; ++a) {
        error[std::size_t{t} * s_.overlap + a] = squared_error(shown(a, t), patch(a, t));
      }
    }
    costs_of_cutting(error, s_.overlap, s_.size);
    return minimum_error_cut(error, s_.overlap, s_.size);
  }

  // What the texture shows in the overlaps of patch (i, j) with the patches to its left and above it.
  struct Overlaps {
    bool left = false, above = false;
    std::vector<std::int16_t> left_values, above_values;  // a fastest, then t
  };
  Overlaps overlaps(std::uint32_t i, std::uint32_t j) const {
    Overlaps out;
    out.left = i > 0;
    out.above = j > 0;
    const std::size_t size = std::size_t{s_.overlap} * s_.size * match_.channels;
    if (out.left) out.left_values.resize(size);
    if (out.above) out.above_values.resize(size);
    for (std::uint32_t t = 0; t < s_.size; ++t) {
      for (std::uint32_t a = 0; a < s_.overlap; ++a) {
        const std::size_t at = (std::size_t{t} * s_.overlap + a) * match_.channels;
        if (out.left) shown_values(i, j, a, t, &out.left_values[at]);
        if (out.above) shown_values(i, j, t, a, &out.above_values[at]);
      }
    }
    return out;
  }
  // The L of the paper as two cuts.
  struct LCut {
    Cut left, above;
  };
  LCut l_cut(const Overlaps& o, const PatchPosition& at) const {
    const auto shown = [&](const std::vector<std::int16_t>& values) {
      return [&](std::uint32_t a, std::uint32_t t) {
        return &values[(std::size_t{t} * s_.overlap + a) * match_.channels];
      };
    };
    LCut out;
    if (o.left)
      out.left = cut(shown(o.left_values), [&](auto a, auto t) { return match_.row(at.x + a, at.y + t); });
    if (o.above)
      out.above = cut(shown(o.above_values), [&](auto a, auto t) { return match_.row(at.x + t, at.y + a); });
    return out;
  }

  struct Choice {
    PatchPosition at;
    LCut cuts;  // quilting
  };

  Choice choose(std::uint32_t i, std::uint32_t j) const {
    const std::uint64_t patch = recipe_.positions.size();
    // Draw n of this patch among count below 2^32: floor(bits / 2^32 * count) with the upper 32 bits.
    const auto draw = [&](std::uint64_t n, std::uint64_t count) {
      return (random_bits(settings_.seed, patch + n * s_.patches()) >> 32) * count >> 32;
    };
    const BoundaryZone zone = boundary_zone(i, j);
    if (zone.runs.empty()) {
      const std::uint32_t columns = s_.sample_width - s_.size + 1, rows = s_.sample_height - s_.size + 1;
      const std::uint64_t n = draw(0, std::uint64_t{columns} * rows);
      return {{static_cast<std::uint32_t>(n % columns), static_cast<std::uint32_t>(n / columns)}, {}};
    }
    const Candidates candidates = settings_.plain_search
                                      ? find_candidates_plain(match_, s_.size, zone, settings_.tau)
                                      : find_candidates(planes_, s_.size, zone, settings_.tau);
    if (!quilting()) return {candidates[draw(0, candidates.size())], {}};
    const Overlaps shown = overlaps(i, j);
    Choice best;
    std::uint64_t best_cost = UINT64_MAX;
    const std::size_t tries = std::min<std::size_t>(settings_.tries, candidates.size());
    for (std::size_t n = 0; n < tries; ++n) {
      // All of them where they are few, draws (a repeated one does no harm) otherwise.
      const bool all = candidates.size() <= settings_.tries && settings_.tries > 1;
      const PatchPosition at = candidates[all ? n : draw(n, candidates.size())];
      LCut cuts = l_cut(shown, at);
      const std::uint64_t cost = cuts.left.cost + cuts.above.cost;
      if (cost >= best_cost) continue;
      best_cost = cost;
      best = {at, std::move(cuts)};
    }
    return best;
  }

  std::span<std::uint16_t> cut_v(std::uint32_t i, std::uint32_t j) {
    const std::size_t number =
        s_.wraps ? std::size_t{j} * s_.count_x + i : std::size_t{j} * (s_.count_x - 1) + i - 1;
    return std::span(recipe_.cuts_v).subspan(number * s_.size, s_.size);
  }
  std::span<std::uint16_t> cut_h(std::uint32_t i, std::uint32_t j) {
    const std::size_t number = (std::size_t{j} - (s_.wraps ? 0 : 1)) * s_.count_x + i;
    return std::span(recipe_.cuts_h).subspan(number * s_.size, s_.size);
  }
  static void keep(std::span<std::uint16_t> place, const Cut& one) {
    std::copy(one.path.begin(), one.path.end(), place.begin());
  }

  // Writes the sample's texel to (x, v) of the strip; weight 256 replaces.
  void put(std::size_t x, std::uint32_t v, std::uint32_t sample_x, std::uint32_t sample_y,
           std::uint32_t weight, bool sample_is_left) {
    for (std::size_t m = 0; m < samples_.size(); ++m) {
      const std::size_t channels = samples_[m].channels;
      const std::uint16_t* from = &samples_[m].codes[samples_[m].index(sample_x, sample_y, 0)];
      std::uint16_t* to = &strip_.maps[m][(std::size_t{v} * width_ + x) * channels];
      for (std::size_t c = 0; c < channels; ++c) {
        if (weight == kReplace) {
          to[c] = from[c];
        } else {
          to[c] = sample_is_left ? lerp(m, from[c], to[c], weight) : lerp(m, to[c], from[c], weight);
        }
      }
    }
  }

  // Copies `count` texels of a sample row to (x, v) of the strip.
  void copy_row(std::size_t x, std::uint32_t v, std::uint32_t sample_x, std::uint32_t sample_y,
                std::uint32_t count) {
    for (std::size_t m = 0; m < samples_.size(); ++m) {
      const std::size_t channels = samples_[m].channels;
      // Pointers, not elements: of an empty run both may lie behind the end.
      std::copy_n(samples_[m].codes.data() + samples_[m].index(sample_x, sample_y, 0), count * channels,
                  strip_.maps[m].data() + (std::size_t{v} * width_ + x) * channels);
    }
  }

  void paste(std::uint32_t i, std::uint32_t j, const PatchPosition& at, const LCut& cuts) {
    if (quilting() && i > 0) keep(cut_v(i, j), cuts.left);
    if (quilting() && j > 0) keep(cut_h(i, j), cuts.above);
    const std::size_t left = std::size_t{i} * s_.step();
    // The last patch of a strip that wraps is closed below.
    const auto end = static_cast<std::uint32_t>(std::min<std::size_t>(s_.size, width_ - left));
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      std::uint32_t begin = 0;
      if (i > 0 && quilting()) begin = cut_v(i, j)[v];  // before it the left patch stays
      if (i > 0 && !quilting()) {
        for (; begin < s_.overlap; ++begin) {
          put(left + begin, v, at.x + begin, at.y + v, patch_weight(begin, s_.overlap), false);
        }
      }
      copy_row(left + begin, v, at.x + begin, at.y + v, end - begin);
      if (quilting() && j > 0 && v < s_.overlap) {
        const auto limits = cut_h(i, j);
        for (std::uint32_t u = begin; u < end; ++u) {
          strip_.above[v * width_ + left + u] = v < limits[u] ? 1 : 0;
        }
      }
    }
    if (s_.wraps && i + 1 == s_.count_x) close_strip(j, at);
  }

  // The last patch of a strip that wraps meets the first: the cut or the weights of patch (0, j).
  void close_strip(std::uint32_t j, const PatchPosition& at) {
    if (quilting()) {
      const PatchPosition first = recipe_.positions[std::size_t{j} * s_.count_x];
      keep(cut_v(0, j), cut([&](auto a, auto t) { return match_.row(at.x + a + s_.step(), at.y + t); },
                            [&](auto a, auto t) { return match_.row(first.x + a, first.y + t); }));
    }
    for (std::uint32_t v = 0; v < s_.size; ++v) {
      for (std::uint32_t u = 0; u < s_.overlap; ++u) {
        if (quilting() && u >= cut_v(0, j)[v]) continue;  // the first patch stays
        put(u, v, at.x + u + s_.step(), at.y + v, quilting() ? kReplace : patch_weight(u, s_.overlap), true);
        if (quilting() && j > 0 && v < s_.overlap) {
          strip_.above[v * width_ + u] = v < cut_h(s_.count_x - 1, j)[u + s_.step()] ? 1 : 0;
        }
      }
    }
  }

  // The last strip (now before_) meets the first: the horizontal cuts of row 0, and where first_ shows it.
  void close_texture() {
    for (std::uint32_t i = 0; i < s_.count_x; ++i) {
      const PatchPosition at = recipe_.positions[i];
      const std::size_t left = std::size_t{i} * s_.step();
      std::vector<std::int16_t> values(match_.channels);
      const auto shown = [&](std::uint32_t a, std::uint32_t t) {
        strip_values(before_, (left + t) % width_, a + s_.step(), values.data());
        return values.data();
      };
      keep(cut_h(i, 0), cut(shown, [&](auto a, auto t) { return match_.row(at.x + t, at.y + a); }));
    }
    for (std::uint32_t v = 0; v < s_.overlap; ++v) {
      for (std::size_t x = 0; x < width_; ++x) {
        const auto i = static_cast<std::uint32_t>(x / s_.step());
        const auto u = static_cast<std::uint32_t>(x % s_.step());
        const bool left_wins = u < s_.overlap && u < cut_v(i, 0)[v];
        const std::uint32_t limit =
            left_wins ? cut_h(i > 0 ? i - 1 : s_.count_x - 1, 0)[u + s_.step()] : cut_h(i, 0)[u];
        first_.above[v * width_ + x] = v < limit ? 1 : 0;
      }
    }
  }

  // Rows begin … end-1 of strip j, as no later strip changes them.
  void emit(const Strip& strip, std::uint32_t j, std::uint32_t begin, std::uint32_t end,
            const RowSink& sink) const {
    std::vector<std::vector<std::uint16_t>> row;
    std::vector<const std::uint16_t*> view;
    for (const Image& sample : samples_) row.emplace_back(width_ * sample.channels);
    for (const auto& r : row) view.push_back(r.data());
    for (std::uint32_t v = begin; v < end; ++v) {
      for (std::size_t m = 0; m < samples_.size(); ++m) {
        for (std::size_t x = 0; x < width_; ++x) {
          shown(strip, m, x, v, has_above(j), &row[m][x * samples_[m].channels]);
        }
      }
      sink(j * s_.step() + v, view);
    }
  }

  static constexpr std::uint32_t kReplace = UINT32_MAX;
  const PatchShape& s_;
  std::span<const Image> samples_;
  const SynthesisSettings& settings_;
  MatchTables tables_;
  MatchImage match_;
  SearchPlanes planes_;
  std::size_t width_;  // of the whole texture
  Strip strip_, before_;
  Strip first_;  // strip 0 of a texture that wraps
  PatchRecipe recipe_;
};

}  // namespace

PatchRecipe synthesize_patches(const PatchShape& shape, std::span<const Image> samples,
                               const SynthesisSettings& settings, const RowSink& sink) {
  return Synthesis(shape, samples, settings).run(sink);
}

}  // namespace btfc
