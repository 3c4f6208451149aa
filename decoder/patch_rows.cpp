// A row of the texture is a row of one strip of patches, or of two joined by horizontal cuts or weights
// (spec/models/patch.md section 4, read row-wise). A row of a strip is a sequence of runs of single patches.
// Compiled once for each instruction set; chosen at run time.
#include "decoder/patch_rows.h"

#include <algorithm>
#include <cstring>

#include "decoder/model_table.h"
#include "shaders/models/patch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "decoder/patch_rows.cpp"
#include <hwy/foreach_target.h>

#include "decoder/patch_kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

// <Model>Params of one map, as the format layer laid it out.
PatchParams params_of(const LoadedItem& item, std::uint32_t map) {
  PatchParams p;
  std::memcpy(&p, item.map_params[map].data(), sizeof p);
  return p;
}

// One strip of patches, unpacked: where each patch lies in the sample, and its cuts.
template <class Entry>
struct StripTables {
  std::uint32_t j = UINT32_MAX;
  std::vector<const std::uint8_t*> patches;  // the sample's texel at local (0, 0)
  std::vector<Entry> cuts_v;                 // [v * k_x + i]: one row of the strip reads along i
  std::vector<Entry> cuts_h;                 // [i * w_B + u]
};

// Entries 0 … count-1 of a cut, to out[t * stride]. As patch_cut, without its branches.
template <class Entry>
void unpack_cut(const std::uint32_t* words, std::size_t word_count, std::size_t first_bit, std::uint32_t bits,
                std::uint32_t count, Entry* out, std::size_t stride) {
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::size_t bit = first_bit + std::size_t{t} * bits, word = bit >> 5;
    const std::uint64_t next = word + 1 < word_count ? words[word + 1] : 0;
    out[t * stride] = static_cast<Entry>((words[word] | next << 32) >> (bit & 31) & mask);
  }
}

// One rectangle of one map.
template <class Entry>
class RowDecoder {
 public:
  RowDecoder(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t width)
      : item_(item),
        p_(params_of(item, map)),
        words_(words_of(item)),
        type_(item.head.maps[map].type),
        channels_(item.head.maps[map].channels),
        texel_bytes_(p_.texel_bits / 8),
        sample_bytes_(type_ == SampleType::unorm8 ? 1 : 2),
        samples_a_texel_(texel_bytes_ / sample_bytes_),
        step_(p_.patch_size - p_.overlap),
        begin_(x),
        end_(x + width),
        row_(std::size_t{width} * texel_bytes_ + kSlack),
        above_row_(row_.size()),
        limits_(width + kSlack),
        pack_(sample_bytes_) {
    if (p_.blend == PATCH_LIANG) {
      across_.resize(std::size_t{p_.overlap} * samples_a_texel_ + kSlack);
      for (std::size_t s = 0; s < across_.size() - kSlack; ++s) {
        across_[s] =
            static_cast<std::uint16_t>(patch_weight(static_cast<uint>(s / samples_a_texel_), p_.overlap));
      }
      down_.resize(std::size_t{width} * samples_a_texel_ + kSlack);
    }
  }

  void decode(std::uint32_t y, std::uint8_t* out) {
    const std::uint32_t j = std::min(y / step_, p_.patch_count_y - 1), v = y - j * step_;
    const bool in_above = (j > 0 || p_.wraps == 1) && v < p_.overlap;
    if (here_.j != j) {
      std::swap(here_, above_);  // rows go downwards: this strip is the one below
      if (here_.j != j) unpack(here_, j);
    }
    const auto* row_end = row_.data() + row_.size();
    if (in_above) {
      compose(here_, v, row_.data());
      const std::uint32_t above_j = j > 0 ? j - 1 : p_.patch_count_y - 1;
      if (above_.j != above_j) unpack(above_, above_j);
      compose(above_, v + step_, above_row_.data());
      join(v);
    } else if (channels_ == 3) {
      compose_packed(v, out);
      return;
    } else {
      compose(here_, v, row_.data());
    }
    if (channels_ == 3) {
      pack_(out, row_.data(), end_ - begin_, out_bytes(), row_end);
    } else {
      std::memcpy(out, row_.data(), out_bytes());
    }
  }

 private:
  // Calls run(x, end, i, u) for the runs of row v: texels x … end-1 belong to patch i, the first at local
  // column u. For liang, patch i's run begins after the overlap, and blend(x, end, i, u) is called for the
  // overlap.
  template <class Run, class Blend>
  void for_runs(const StripTables<Entry>& strip, std::uint32_t v, const Run& run, const Blend& blend) const {
    const std::uint32_t k = p_.patch_count_x;
    std::uint32_t i = std::min(begin_ / step_, k - 1), x = begin_;
    if (p_.blend == PATCH_QUILTING) {
      // Patch i shows from its own cut to the cut of the next: one run, for the sample goes on under the
      // overlap.
      const Entry* cuts = strip.cuts_v.data() + std::size_t{v} * k;
      const auto start = [&](std::uint32_t patch) {
        return patch * step_ + (patch > 0 || p_.wraps == 1 ? cuts[patch] : 0u);
      };
      if (x < start(i)) {  // the left neighbour still shows
        const std::uint32_t stop = std::min(end_, start(i));
        run(x, stop, i > 0 ? i - 1 : k - 1, x - i * step_ + step_);
        x = stop;
      }
      for (; x < end_; ++i) {
        const std::uint32_t stop = i + 1 == k ? end_ : std::min(end_, start(i + 1));
        if (x < stop) run(x, stop, i, x - i * step_);
        x = stop;
      }
      return;
    }
    for (; x < end_; ++i) {
      const std::uint32_t left = i * step_, stop = i + 1 == k ? end_ : std::min(end_, left + step_);
      const std::uint32_t shared = i > 0 || p_.wraps == 1 ? std::min(stop, left + p_.overlap) : left;
      if (x < shared) {
        blend(x, shared, i, x - left);
        x = shared;
      }
      if (x < stop) run(x, stop, i, x - left);
      x = stop;
    }
  }

  std::size_t out_bytes() const { return std::size_t{end_ - begin_} * channels_ * sample_bytes_; }
  const std::uint8_t* source(const StripTables<Entry>& strip, std::uint32_t i, std::uint32_t u,
                             std::uint32_t v) const {
    return strip.patches[i] + (std::size_t{v} * p_.sample_width + u) * texel_bytes_;
  }
  const std::uint8_t* sample_end() const {
    const auto& sample = item_.words[PATCH_SAMPLE];
    return reinterpret_cast<const std::uint8_t*>(sample.data() + sample.size());
  }
  // The overlap of patch i with its left neighbour, from local column u.
  void blend(const StripTables<Entry>& strip, std::uint32_t i, std::uint32_t u, std::uint32_t v,
             std::size_t count, std::uint8_t* out) const {
    const std::uint32_t before = i > 0 ? i - 1 : p_.patch_count_x - 1;
    const std::uint8_t *a = source(strip, before, u + step_, v), *b = source(strip, i, u, v);
    lerp_samples(type_, out, a, b, across_.data() + std::size_t{u} * samples_a_texel_,
                 count * samples_a_texel_, static_cast<std::size_t>(sample_end() - std::max(a, b)));
  }

  // Row v of a strip, padded texels.
  void compose(const StripTables<Entry>& strip, std::uint32_t v, std::uint8_t* row) const {
    const std::uint8_t* end_of_sample = sample_end();
    const auto place = [&](std::uint32_t x) { return row + std::size_t{x - begin_} * texel_bytes_; };
    for_runs(
        strip, v,
        [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) {
          copy_run(place(x), source(strip, i, u, v), std::size_t{end - x} * texel_bytes_, end_of_sample);
        },
        [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) {
          blend(strip, i, u, v, end - x, place(x));
        });
  }

  // Row v of the strip at hand, three channels straight to the output.
  void compose_packed(std::uint32_t v, std::uint8_t* out) {
    const std::uint8_t* end_of_sample = sample_end();
    const std::size_t size = out_bytes(), texel = 3 * sample_bytes_;
    const auto offset = [&](std::uint32_t x) { return (x - begin_) * texel; };
    const auto blended = [&](std::uint32_t x) {
      return row_.data() + std::size_t{x - begin_} * texel_bytes_;
    };
    // All blends first: packing a texel right after it was written would wait for the store.
    if (p_.blend == PATCH_LIANG) {
      for_runs(
          here_, v, [](auto...) {},
          [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) {
            blend(here_, i, u, v, end - x, blended(x));
          });
    }
    for_runs(
        here_, v,
        [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) {
          pack_(out + offset(x), source(here_, i, u, v), end - x, size - offset(x), end_of_sample);
        },
        [&](std::uint32_t x, std::uint32_t end, std::uint32_t, std::uint32_t) {
          pack_(out + offset(x), blended(x), end - x, size - offset(x), row_.data() + row_.size());
        });
  }

  // Lets the strip above show through where the texture does so, local row v.
  void join(std::uint32_t v) {
    const std::size_t width = end_ - begin_;
    if (p_.blend == PATCH_LIANG) {
      std::fill(down_.begin(), down_.end(), static_cast<std::uint16_t>(patch_weight(v, p_.overlap)));
      lerp_samples(type_, row_.data(), above_row_.data(), row_.data(), down_.data(), width * samples_a_texel_,
                   row_.size());
      return;
    }
    const auto* cuts_end = reinterpret_cast<const std::uint8_t*>(here_.cuts_h.data() + here_.cuts_h.size());
    for_runs(
        here_, v,
        [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) {
          const Entry* from = here_.cuts_h.data() + std::size_t{i} * p_.patch_size + u;
          copy_run(reinterpret_cast<std::uint8_t*>(&limits_[x - begin_]),
                   reinterpret_cast<const std::uint8_t*>(from), (end - x) * sizeof(Entry), cuts_end);
        },
        [](auto...) {});
    select_above(row_.data(), above_row_.data(), limits_.data(), v, width, texel_bytes_);
  }

  void unpack(StripTables<Entry>& strip, std::uint32_t j) const {
    const std::uint32_t k = p_.patch_count_x, size = p_.patch_size;
    strip.j = j;
    strip.patches.resize(k);
    const auto* plane = reinterpret_cast<const std::uint8_t*>(words_.slot[PATCH_SAMPLE] + p_.plane_word);
    for (std::uint32_t i = 0; i < k; ++i) {
      const uvec2 at = patch_coordinates(words_, p_, i, j);
      strip.patches[i] = plane + (std::size_t{at.y} * p_.sample_width + at.x) * texel_bytes_;
    }
    if (p_.blend == PATCH_LIANG) return;
    strip.cuts_v.resize(std::size_t{k} * size);
    strip.cuts_h.resize(std::size_t{k} * size + kSlack);
    if (p_.cut_bits == 0) return;  // all entries 0
    const auto take = [&](uint slot, std::uint32_t cut, Entry* out, std::size_t stride) {
      unpack_cut(item_.words[slot].data(), item_.words[slot].size(), std::size_t{cut} * p_.cut_stride,
                 p_.cut_bits, size, out, stride);
    };
    for (std::uint32_t i = 0; i < k; ++i) {
      const bool beside = i > 0 || p_.wraps == 1, below = j > 0 || p_.wraps == 1;
      if (beside) take(PATCH_CUTS_V, patch_number_v(p_, i, j), &strip.cuts_v[i], k);
      if (below) take(PATCH_CUTS_H, patch_number_h(p_, i, j), &strip.cuts_h[std::size_t{i} * size], 1);
    }
  }

  const LoadedItem& item_;
  const PatchParams p_;
  const BtfcWords words_;
  const SampleType type_;
  const std::uint32_t channels_, texel_bytes_, sample_bytes_, samples_a_texel_, step_, begin_, end_;
  StripTables<Entry> here_, above_;
  std::vector<std::uint8_t> row_, above_row_;
  std::vector<Entry> limits_;
  const PackThree pack_;
  std::vector<std::uint16_t> across_, down_;  // liang's weights, one a sample
};

template <class Entry>
void decode_rows_as(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                    std::uint32_t width, std::uint32_t height, std::uint8_t* out, std::size_t row_stride) {
  RowDecoder<Entry> decoder(item, map, x, width);
  for (std::uint32_t r = 0; r < height; ++r) decoder.decode(y + r, out + r * row_stride);
}

void decode_rows_target(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                        std::uint32_t width, std::uint32_t height, std::uint8_t* out,
                        std::size_t row_stride) {
  if (params_of(item, map).overlap <= 256) {
    decode_rows_as<std::uint8_t>(item, map, x, y, width, height, out, row_stride);
  } else {
    decode_rows_as<std::uint16_t>(item, map, x, y, width, height, out, row_stride);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(decode_rows_target);

void patch_decode_rows(const LoadedItem& item, std::uint32_t map, std::uint32_t x, std::uint32_t y,
                       std::uint32_t width, std::uint32_t height, std::uint8_t* out, std::size_t row_stride) {
  HWY_DYNAMIC_DISPATCH(decode_rows_target)(item, map, x, y, width, height, out, row_stride);
}

// floor(x / step) = floor(x r / 2^32) with r = floor(2^32 / step) + 1, exact for x and step up to 2^16: r
// exceeds 2^32 / step by at most 1, so the product is too large by at most x / 2^32 < 1 / step.
std::vector<std::uint64_t> patch_make_tables(const LoadedItem& item) {
  PatchParams p;
  std::memcpy(&p, item.map_params[0].data(), sizeof p);
  return {(std::uint64_t{1} << 32) / (p.patch_size - p.overlap) + 1};
}

void patch_decode_texels(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                         const std::int32_t* texels, std::size_t count, std::uint8_t* out) {
  PatchParams p;
  std::memcpy(&p, item.map_params[map].data(), sizeof p);
  const BtfcWords words = words_of(item);
  const std::uint64_t reciprocal = tables[0];
  const std::uint32_t step = p.patch_size - p.overlap, channels = item.head.maps[map].channels;
  for (std::size_t q = 0; q < count; ++q) {
    const std::uint32_t x = btfc_wrap(texels[2 * q], p.width, p.wraps),
                        y = btfc_wrap(texels[2 * q + 1], p.height, p.wraps);
    const std::uint32_t i = std::min(static_cast<std::uint32_t>(x * reciprocal >> 32), p.patch_count_x - 1);
    const std::uint32_t j = std::min(static_cast<std::uint32_t>(y * reciprocal >> 32), p.patch_count_y - 1);
    const uvec4 codes = patch_codes_at(words, p, i, j, x - i * step, y - j * step);
    for (std::uint32_t c = 0; c < channels; ++c) {
      const std::uint32_t code = codes[static_cast<int>(c)];
      if (p.sample_type == BTFC_CODE_UNORM8) {
        *out++ = static_cast<std::uint8_t>(code);
      } else {
        const auto wide = static_cast<std::uint16_t>(code);
        std::memcpy(out, &wide, 2);
        out += 2;
      }
    }
  }
}

}  // namespace btfc
#endif
