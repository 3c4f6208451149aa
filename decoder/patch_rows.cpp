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
  std::vector<Entry> cuts_v;                 // [i * w_B + v]
  std::vector<Entry> limits_h;  // [(i * w_B + u) * channels + c]: the horizontal cuts, for each sample
};

// One rectangle of one map. Texels are tightly packed everywhere: in the sample, in buffers and in the
// output.
template <class Entry>
class RowDecoder {
 public:
  RowDecoder(const LoadedItem& item, const PackedSample& sample, std::uint32_t map, std::uint32_t x,
             std::uint32_t width)
      : item_(item),
        p_(params_of(item, map)),
        words_(words_of(item)),
        sample_(sample),
        type_(item.head.maps[map].type),
        channels_(item.head.maps[map].channels),
        sample_bytes_(type_ == SampleType::unorm8 ? 1 : 2),
        texel_bytes_(channels_ * sample_bytes_),
        step_(p_.patch_size - p_.overlap),
        begin_(x),
        end_(x + width),
        first_patch_(std::min(x / step_, p_.patch_count_x - 1)),
        last_patch_(std::min((end_ - 1) / step_, p_.patch_count_x - 1)),
        above_row_((std::size_t{width} + p_.patch_size) * texel_bytes_ + kSlack) {
    if (p_.blend == PATCH_LIANG) {
      across_.assign(std::size_t{p_.overlap} * channels_, [&](std::size_t s) {
        return patch_weight(static_cast<uint>(s / channels_), p_.overlap);
      });
      row_.resize(above_row_.size());
    }
  }

  void decode(std::uint32_t y, std::uint8_t* out) {
    const std::uint32_t j = std::min(y / step_, p_.patch_count_y - 1), v = y - j * step_;
    const bool in_above = (j > 0 || p_.wraps == 1) && v < p_.overlap;
    if (here_.j != j) {
      std::swap(here_, above_);  // rows go downwards: this strip is the one below
      if (here_.j != j) unpack(here_, j);
    }
    if (!in_above) {
      compose(here_, v, out, row_bytes());
      return;
    }
    const std::uint32_t above_j = j > 0 ? j - 1 : p_.patch_count_y - 1;
    if (above_.j != above_j) unpack(above_, above_j);
    compose(above_, v + step_, above_row_.data(), above_row_.size());
    if (p_.blend == PATCH_LIANG) {
      compose(here_, v, row_.data(), row_.size());
      const std::size_t samples = row_bytes() / sample_bytes_;
      down_.assign_uniform(patch_weight(v, p_.overlap));
      lerp_samples(type_, out, above_row_.data(), row_.data(), down_.factors(), 0, samples, row_bytes(),
                   row_.size());
    } else if (sample_bytes_ == 1) {
      compose_below<std::uint8_t>(v, out);
    } else {
      compose_below<std::uint16_t>(v, out);
    }
  }

 private:
  // What the loops over runs need, as values: members would be read again after every store of a byte.
  struct Loop {
    std::uint32_t k, size, step, overlap, begin, end, first_patch, last_patch;
    bool wraps;
    std::size_t texel_bytes, channels, row_offset;  // of row v in the sample, bytes
    const std::uint8_t* const* patches;
    const std::uint8_t* sample_end;

    const std::uint8_t* source(std::uint32_t i, std::uint32_t u) const {
      return patches[i] + row_offset + u * texel_bytes;
    }
    std::size_t offset(std::uint32_t x) const { return (x - begin) * texel_bytes; }
    std::size_t readable(const std::uint8_t* from) const {
      return static_cast<std::size_t>(sample_end - from);
    }
  };
  Loop loop_of(const StripTables<Entry>& strip, std::uint32_t v) const {
    return {p_.patch_count_x,     p_.patch_size, step_,
            p_.overlap,           begin_,        end_,
            first_patch_,         last_patch_,   p_.wraps == 1,
            texel_bytes_,         channels_,     std::size_t{v} * p_.sample_width * texel_bytes_,
            strip.patches.data(), sample_.end};
  }

  // Calls run(x, end, i, u) for the runs of row v: texels x … end-1 belong to patch i, the first at local
  // column u. A patch shows from its own cut to the cut of the next: one run, for the sample goes on under
  // the overlap.
  template <class Run>
  HWY_INLINE static void quilted_runs(const Loop& g, const Entry* cuts_of_row, const Run& run) {
    const auto start = [&](std::uint32_t i) {
      return i * g.step + (i > 0 || g.wraps ? cuts_of_row[std::size_t{i} * g.size] : 0u);
    };
    std::uint32_t i = g.first_patch, x = g.begin;
    if (x < start(i)) {  // the left neighbour still shows
      const std::uint32_t stop = std::min(g.end, start(i));
      run(x, stop, i > 0 ? i - 1 : g.k - 1, x - i * g.step + g.step);
      x = stop;
    }
    for (; x < g.end; ++i) {
      const std::uint32_t stop = i >= g.last_patch ? g.end : std::min(g.end, start(i + 1));
      if (x < stop) run(x, stop, i, x - i * g.step);
      x = stop;
    }
  }

  // The same for liang: patch i's run begins after the overlap, and blend(x, end, i, u) is called for the
  // overlap.
  template <class Run, class Blend>
  HWY_INLINE static void feathered_runs(const Loop& g, const Run& run, const Blend& blend) {
    std::uint32_t x = g.begin;
    for (std::uint32_t i = g.first_patch; x < g.end; ++i) {
      const std::uint32_t left = i * g.step, stop = i + 1 == g.k ? g.end : std::min(g.end, left + g.step);
      const std::uint32_t shared = i > 0 || g.wraps ? std::min(stop, left + g.overlap) : left;
      if (x < shared) {
        blend(x, shared, i, x - left);
        x = shared;
      }
      if (x < stop) run(x, stop, i, x - left);
      x = stop;
    }
  }

  std::size_t row_bytes() const { return std::size_t{end_ - begin_} * texel_bytes_; }

  // Row v of a strip to `row` with room bytes.
  void compose(const StripTables<Entry>& strip, std::uint32_t v, std::uint8_t* row, std::size_t room) const {
    const Loop g = loop_of(strip, v);
    // Runs of liang have one length but at the borders; those of quilting vary with the cuts.
    const std::size_t longest = p_.blend == PATCH_LIANG ? 0 : g.size * g.texel_bytes;
    const auto copy = [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) HWY_ATTR {
      const std::uint8_t* from = g.source(i, u);
      const std::size_t size = (end - x) * g.texel_bytes;
      copy_run(row + g.offset(x), from, size, std::max(size, longest), room - g.offset(x), g.readable(from));
    };
    if (p_.blend == PATCH_QUILTING) {
      quilted_runs(g, strip.cuts_v.data() + v, copy);
      return;
    }
    const LerpFactors across = across_.factors();
    const SampleType type = type_;
    feathered_runs(
        g, copy, [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) HWY_ATTR {
          // The overlap of patch i with its left neighbour, from local column u.
          const std::uint8_t *a = g.source(i > 0 ? i - 1 : g.k - 1, u + g.step), *b = g.source(i, u);
          lerp_samples(type, row + g.offset(x), a, b, across, u * g.channels, (end - x) * g.channels,
                       room - g.offset(x), g.readable(std::max(a, b)));
        });
  }

  // Row v of the strip at hand, with above_row_ where the horizontal cuts let it show.
  template <class Sample>
  void compose_below(std::uint32_t v, std::uint8_t* out) const {
    const Loop g = loop_of(here_, v);
    const Entry* limits = here_.limits_h.data();
    const std::uint8_t* above = above_row_.data();
    const std::size_t room = row_bytes(), most = g.size * g.channels;
    quilted_runs(g, here_.cuts_v.data() + v,
                 [&](std::uint32_t x, std::uint32_t end, std::uint32_t i, std::uint32_t u) HWY_ATTR {
                   const std::uint8_t* from = g.source(i, u);
                   select_run<Sample>(out + g.offset(x), above + g.offset(x), from,
                                      limits + (std::size_t{i} * g.size + u) * g.channels, v,
                                      (end - x) * g.channels, most, room - g.offset(x), g.readable(from));
                 });
  }

  void unpack(StripTables<Entry>& strip, std::uint32_t j) const {
    const std::uint32_t k = p_.patch_count_x, size = p_.patch_size;
    strip.j = j;
    strip.patches.resize(k);
    const auto place = [&](std::uint32_t i) {
      const uvec2 at = patch_coordinates(words_, p_, i, j);
      strip.patches[i] = sample_.texels + (std::size_t{at.y} * p_.sample_width + at.x) * texel_bytes_;
    };
    // The rectangle's patches, and the one to the left of them.
    const bool round = p_.wraps == 1 && first_patch_ == 0;
    const std::uint32_t first = first_patch_ > 0 ? first_patch_ - 1 : 0;
    for (std::uint32_t i = first; i <= last_patch_; ++i) place(i);
    if (round) place(k - 1);
    if (p_.blend == PATCH_LIANG) return;
    strip.cuts_v.resize(std::size_t{k} * size + kSlack);
    strip.limits_h.resize((std::size_t{k + 1} * size + kSlack) *
                          channels_);  // a run may be read as if it were whole
    if (p_.cut_bits == 0) return;      // all entries 0
    const auto take = [&](uint slot, std::uint32_t cut, Entry* out) {
      unpack_cut(item_.words[slot].data(), item_.words[slot].size(), std::size_t{cut} * p_.cut_stride,
                 p_.cut_bits, size, out);
    };
    std::vector<Entry> cut(size + kSlack);
    const auto take_h = [&](std::uint32_t i) {
      if (j == 0 && p_.wraps == 0) return;
      take(PATCH_CUTS_H, patch_number_h(p_, i, j), cut.data());
      repeat_entries(cut.data(), size, channels_, &strip.limits_h[std::size_t{i} * size * channels_]);
    };
    // Upwards: what an unpacked cut writes too much belongs to the next.
    for (std::uint32_t i = first; i <= last_patch_; ++i) {
      if (i > 0 || p_.wraps == 1) {
        take(PATCH_CUTS_V, patch_number_v(p_, i, j), &strip.cuts_v[std::size_t{i} * size]);
      }
      take_h(i);
    }
    if (round && last_patch_ < k - 1) take_h(k - 1);
  }

  const LoadedItem& item_;
  const PatchParams p_;
  const BtfcWords words_;
  const PackedSample sample_;
  const SampleType type_;
  const std::uint32_t channels_, sample_bytes_, texel_bytes_, step_, begin_, end_, first_patch_, last_patch_;
  StripTables<Entry> here_, above_;
  std::vector<std::uint8_t> row_, above_row_;
  LerpWeights across_, down_;  // liang's weights, towards the left and the strip above
};

template <class Entry>
void decode_rows_as(const LoadedItem& item, const PackedSample& sample, std::uint32_t map, const Rows& rows) {
  RowDecoder<Entry> decoder(item, sample, map, rows.x, rows.width);
  for (std::uint32_t r = 0; r < rows.height; ++r) decoder.decode(rows.y + r, rows.out + r * rows.row_stride);
}

void decode_rows_target(const LoadedItem& item, const PackedSample& sample, std::uint32_t map,
                        const Rows& rows) {
  if (params_of(item, map).overlap <= 256) {
    decode_rows_as<std::uint8_t>(item, sample, map, rows);
  } else {
    decode_rows_as<std::uint16_t>(item, sample, map, rows);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(decode_rows_target);

namespace {

PatchParams params_of_map(const LoadedItem& item, std::uint32_t map) {
  PatchParams p;
  std::memcpy(&p, item.map_params[map].data(), sizeof p);
  return p;
}

// Words of 64 bits that the packed copy of a map's sample takes; 0 where the plane itself is tight.
std::size_t copy_words(const LoadedItem& item, std::uint32_t map) {
  const Plane& plane = item.planes[map];
  if (plane.channels != 3) return 0;
  return (std::size_t{plane.width} * plane.height * (plane.texel_bits / 8 * 3 / 4) + 7) / 8;
}

}  // namespace

// floor(x / step) = floor(x r / 2^32) with r = floor(2^32 / step) + 1, exact for x and step up to 2^16: r
// exceeds 2^32 / step by at most 1, so the product is too large by at most x / 2^32 < 1 / step.
std::vector<std::uint64_t> patch_make_tables(const LoadedItem& item) {
  const PatchParams first = params_of_map(item, 0);
  std::vector<std::uint64_t> tables = {(std::uint64_t{1} << 32) / (first.patch_size - first.overlap) + 1};
  for (std::uint32_t m = 0; m < item.head.maps.size(); ++m) {
    if (copy_words(item, m) == 0) continue;
    const Plane& plane = item.planes[m];
    const std::size_t begin = tables.size(), texel = plane.texel_bits / 8, wanted = texel * 3 / 4;
    tables.resize(begin + copy_words(item, m));
    const auto* from =
        reinterpret_cast<const std::uint8_t*>(item.words[PATCH_SAMPLE].data() + plane.first_word);
    auto* to = reinterpret_cast<std::uint8_t*>(tables.data() + begin);
    const std::size_t texels = std::size_t{plane.width} * plane.height;
    for (std::size_t t = 0; t < texels; ++t) std::memcpy(to + t * wanted, from + t * texel, wanted);
  }
  return tables;
}

namespace {

PackedSample packed_sample(const LoadedItem& item, const std::vector<std::uint64_t>& tables,
                           std::uint32_t map) {
  const auto bytes = [](const auto& words) {
    const auto* begin = reinterpret_cast<const std::uint8_t*>(words.data());
    return PackedSample{begin, begin + words.size() * sizeof words[0]};
  };
  if (copy_words(item, map) == 0) {
    PackedSample sample = bytes(item.words[PATCH_SAMPLE]);
    sample.texels += std::size_t{4} * item.planes[map].first_word;
    return sample;
  }
  PackedSample sample = bytes(tables);
  sample.texels += 8;
  for (std::uint32_t m = 0; m < map; ++m) sample.texels += 8 * copy_words(item, m);
  return sample;
}

}  // namespace

void patch_decode_rows(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                       std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
                       std::uint8_t* out, std::size_t row_stride) {
  HWY_DYNAMIC_DISPATCH(decode_rows_target)
  (item, packed_sample(item, tables, map), map, {x, y, width, height, out, row_stride});
}

void patch_decode_texels(const LoadedItem& item, const std::vector<std::uint64_t>& tables, std::uint32_t map,
                         const std::int32_t* texels, std::size_t count, std::uint8_t* out) {
  const PatchParams p = params_of_map(item, map);
  const BtfcWords words = words_of(item);
  const std::uint8_t* sample = packed_sample(item, tables, map).texels;
  const std::uint64_t reciprocal = tables[0];
  const std::uint32_t step = p.patch_size - p.overlap, channels = item.head.maps[map].channels;
  const std::size_t sample_bytes = p.sample_type == BTFC_CODE_UNORM8 ? 1 : 2,
                    texel_bytes = channels * sample_bytes;
  for (std::size_t q = 0; q < count; ++q, out += texel_bytes) {
    const std::uint32_t x = btfc_wrap(texels[2 * q], p.width, p.wraps),
                        y = btfc_wrap(texels[2 * q + 1], p.height, p.wraps);
    const std::uint32_t i = std::min(static_cast<std::uint32_t>(x * reciprocal >> 32), p.patch_count_x - 1);
    const std::uint32_t j = std::min(static_cast<std::uint32_t>(y * reciprocal >> 32), p.patch_count_y - 1);
    uvec4 at(i, j, x - i * step, y - j * step);
    if (at.z < p.overlap || at.w < p.overlap) {
      if (p.blend == PATCH_LIANG) {
        const uvec4 codes = patch_codes_at(words, p, i, j, at.z, at.w);
        for (std::uint32_t c = 0; c < channels; ++c) {
          std::memcpy(out + c * sample_bytes, &codes[static_cast<int>(c)], sample_bytes);  // little-endian
        }
        continue;
      }
      at = patch_shown(words, p, i, j, at.z, at.w);
    }
    const uvec2 corner = patch_coordinates(words, p, at.x, at.y);
    const std::size_t texel = std::size_t{corner.y + at.w} * p.sample_width + corner.x + at.z;
    const std::uint8_t* from = sample + texel * texel_bytes;
    if (texel_bytes == 3) {  // a constant size needs no call
      std::memcpy(out, from, 3);
    } else {
      std::memcpy(out, from, texel_bytes);
    }
  }
}

}  // namespace btfc
#endif
