// Sums of products with Highway: one binary, the best instruction set found at run time. A lane is a position
// of the sample, so there is no sum across lanes and no remainder of a row.
#include "encoder/models/patch_distance.h"

#include <algorithm>
#include <cstring>

#include "encoder/models/patch_search.h"

#define HWY_WANT_AVX3_DL  // has the byte products (VNNI)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/patch_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

bool has_quads() { return HWY_TARGET == HWY_AVX3_DL; }

// A rectangle's texels in the planes, and its words.
struct Operands {
  const std::uint8_t* texels;  // of the first row and channel, at the first position
  std::size_t row_stride, channel_stride;
  const std::int32_t* words;
  std::uint32_t rows, channels, row_words;
};

// Sums of products of kVectors vectors of positions: each word is loaded once for all of them.
#if HWY_TARGET == HWY_SCALAR

constexpr std::uint32_t kVectors = 1;
std::size_t lanes() { return 1; }

void sum_products(const Operands& o, bool, std::int32_t* sums) {
  *sums = 0;
  const std::int32_t* words = o.words;
  for (std::uint32_t row = 0; row < o.rows; ++row) {
    for (std::uint32_t channel = 0; channel < o.channels; ++channel) {
      const std::uint8_t* texels = o.texels + row * o.row_stride + channel * o.channel_stride;
      for (std::uint32_t i = 0; i < o.row_words; ++i, texels += 8, ++words) {
        std::int16_t s[2], t[2];
        std::memcpy(s, texels, 4);
        std::memcpy(t, words, 4);
        *sums += s[0] * t[0] + s[1] * t[1];
      }
    }
  }
}

#else

constexpr std::uint32_t kVectors = 3;
std::size_t lanes() { return hn::Lanes(hn::ScalableTag<std::int32_t>()); }

#if HWY_TARGET == HWY_AVX3_DL
__attribute__((target("avx512vnni")))  // every processor of this target has it; Highway does not name it
#endif
void sum_products(const Operands& o, bool quads, std::int32_t* sums) {
  const hn::ScalableTag<std::int32_t> d;
  const hn::ScalableTag<std::uint8_t> d8;
  const std::size_t step = 4 * lanes();
  auto a = hn::Zero(d), b = a, c = a;
  const std::int32_t* words = o.words;
#if HWY_TARGET == HWY_AVX3_DL
  for (std::uint32_t row = 0; row < o.rows; ++row) {
    for (std::uint32_t channel = 0; channel < o.channels; ++channel, words += o.row_words) {
      const std::uint8_t* texels = o.texels + row * o.row_stride + channel * o.channel_stride;
      if (quads) {
        for (std::uint32_t i = 0; i < o.row_words; ++i, texels += 16) {
          const __m512i word = _mm512_set1_epi32(words[i]);
          a.raw = _mm512_dpbusd_epi32(a.raw, hn::LoadU(d8, texels).raw, word);
          b.raw = _mm512_dpbusd_epi32(b.raw, hn::LoadU(d8, texels + step).raw, word);
          c.raw = _mm512_dpbusd_epi32(c.raw, hn::LoadU(d8, texels + 2 * step).raw, word);
        }
      } else {
        for (std::uint32_t i = 0; i < o.row_words; ++i, texels += 8) {
          const __m512i word = _mm512_set1_epi32(words[i]);
          a.raw = _mm512_dpwssd_epi32(a.raw, hn::LoadU(d8, texels).raw, word);
          b.raw = _mm512_dpwssd_epi32(b.raw, hn::LoadU(d8, texels + step).raw, word);
          c.raw = _mm512_dpwssd_epi32(c.raw, hn::LoadU(d8, texels + 2 * step).raw, word);
        }
      }
    }
  }
#else
  (void)quads;
  const hn::ScalableTag<std::int16_t> d16;
  auto a1 = a, b1 = a, c1 = a;
  for (std::uint32_t row = 0; row < o.rows; ++row) {
    for (std::uint32_t channel = 0; channel < o.channels; ++channel, words += o.row_words) {
      const std::uint8_t* texels = o.texels + row * o.row_stride + channel * o.channel_stride;
      for (std::uint32_t i = 0; i < o.row_words; ++i, texels += 8) {
        const auto word = hn::BitCast(d16, hn::Set(d, words[i]));
        const auto load = [&](std::size_t n) { return hn::BitCast(d16, hn::LoadU(d8, texels + n * step)); };
        a = hn::ReorderWidenMulAccumulate(d, load(0), word, a, a1);
        b = hn::ReorderWidenMulAccumulate(d, load(1), word, b, b1);
        c = hn::ReorderWidenMulAccumulate(d, load(2), word, c, c1);
      }
    }
  }
  a = hn::RearrangeToOddPlusEven(a, a1);
  b = hn::RearrangeToOddPlusEven(b, b1);
  c = hn::RearrangeToOddPlusEven(c, c1);
#endif
  hn::StoreU(a, d, sums);
  hn::StoreU(b, d, sums + lanes());
  hn::StoreU(c, d, sums + 2 * lanes());
}

#endif

void zone_distances_target(const SearchPlanes& sample, const ZoneTemplate& zone, std::uint32_t x,
                           std::uint32_t y, std::uint32_t count, std::uint64_t limit,
                           std::uint64_t* distances) {
  constexpr std::size_t kMost = kVectors * HWY_MAX_BYTES / 4;
  static_assert(kMost <= SearchPlanes::kPaddingTexels);
  const auto group = static_cast<std::uint32_t>(kVectors * lanes());
  for (std::uint32_t p = 0; p < count; p += group) {
    const std::uint32_t valid = std::min(count - p, group);
    std::uint64_t total[kMost] = {};
    for (const ZoneTemplate::Block& block : zone.blocks) {
      const std::uint32_t left = x + p + block.u, top = y + block.v;
      std::int32_t products[kMost];
      sum_products({sample.at(0, left, top), sample.row_stride(), sample.channel_stride(),
                    zone.words.data() + block.first_word, block.rows, sample.channels(), block.row_words},
                   sample.quads(), products);
      const std::int64_t *above = sample.sums(top) + left, *below = sample.sums(top + block.rows) + left;
      std::uint64_t least = UINT64_MAX;
      for (std::uint32_t i = 0; i < valid; ++i) {
        const std::int64_t own = below[i + block.width] - below[i] - above[i + block.width] + above[i];
        total[i] += block.squares + static_cast<std::uint64_t>(own - 2 * std::int64_t{products[i]});
        least = std::min(least, total[i]);
      }
      if (least > limit) break;
    }
    std::copy_n(total, valid, distances + p);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {
namespace {

HWY_EXPORT(has_quads);
HWY_EXPORT(zone_distances_target);

// Words of a rectangle after which positions are looked at again: are any still worth their sums?
constexpr std::uint32_t kWordsALook = 192;

}  // namespace

SearchPlanes::SearchPlanes(const MatchImage& sample, bool allow_quads)
    : width_(sample.width),
      height_(sample.height),
      channels_(sample.channels),
      stride_(sample.width + kPaddingTexels) {
  const auto [least, most] = std::minmax_element(sample.values.begin(), sample.values.end());
  quads_ = allow_quads && *least >= 0 && *most <= 255 && HWY_DYNAMIC_DISPATCH(has_quads)();
  centre_ = quads_ ? 128 : (*least + *most) / 2;
  // Of one word: 4 x 255 x 128 at most, or twice the square of half the range.
  const auto half = static_cast<std::uint64_t>((*most - *least) / 2 + 1);
  words_a_sum_ =
      static_cast<std::uint32_t>((std::uint64_t{1} << 31) / (quads_ ? 4 * 255 * 128 : 2 * half * half) - 1);

  words_.resize(4 * stride_ * height_ * channels_);
  sums_.resize(std::size_t{width_ + 1} * (height_ + 1));
  for (std::uint32_t y = 0; y < height_; ++y) {
    std::int64_t row_sum = 0;
    for (std::uint32_t x = 0; x < width_; ++x) {
      for (std::uint32_t c = 0; c < channels_; ++c) {
        std::uint8_t* word = words_.data() + 4 * ((std::size_t{c} * height_ + y) * stride_ + x);
        const std::int32_t value = sample.row(x, y)[c];
        const std::int32_t own = value - centre_;
        row_sum += quads_ ? value * (value - 2 * centre_) : own * own;
        if (quads_) {
          for (std::uint32_t back = 0; back < std::min(4u, x + 1); ++back) {
            *(word - 3 * std::ptrdiff_t{back}) = static_cast<std::uint8_t>(value);
          }
        } else {
          const auto code = static_cast<std::int16_t>(own);
          std::memcpy(word, &code, 2);
          if (x > 0) std::memcpy(word - 2, &code, 2);
        }
      }
      sums_[std::size_t{y + 1} * (width_ + 1) + x + 1] =
          sums_[std::size_t{y} * (width_ + 1) + x + 1] + row_sum;
    }
  }
}

ZoneTemplate zone_template(const BoundaryZone& zone, const SearchPlanes& sample) {
  const std::uint32_t channels = sample.channels(), texels = sample.texels_a_word();
  // Pieces of runs, the same columns one below the other, so that they make rectangles; none longer than what
  // a 32-bit sum over its channels takes.
  struct Piece {
    ZoneRun run;
    const std::int16_t* values;
  };
  std::vector<Piece> pieces;
  const std::uint32_t longest = texels * (sample.words_a_sum() / channels);
  const std::int16_t* next = zone.values.data();
  for (const ZoneRun& run : zone.runs) {
    for (std::uint32_t begin = 0; begin < run.length; begin += longest) {
      const std::uint32_t length = std::min(longest, run.length - begin);
      pieces.push_back({{run.v, run.u + begin, length}, next});
      next += std::size_t{length} * channels;
    }
  }
  std::ranges::stable_sort(pieces, {}, [](const Piece& p) { return std::pair(p.run.u, p.run.length); });

  ZoneTemplate out;
  for (const auto& [run, values] : pieces) {
    const std::uint32_t row_words = (run.length + texels - 1) / texels;
    const auto goes_on = [&, &run = run](const ZoneTemplate::Block& b) {
      const std::uint32_t words = b.rows * row_words * channels;
      return b.u == run.u && b.width == run.length && b.v + b.rows == run.v && words < kWordsALook &&
             words + row_words * channels <= sample.words_a_sum();
    };
    if (out.blocks.empty() || !goes_on(out.blocks.back())) {
      out.blocks.push_back({run.u, run.v, run.length, 0, row_words, out.words.size(), 0});
    }
    ZoneTemplate::Block& block = out.blocks.back();
    ++block.rows;
    for (std::uint32_t c = 0; c < channels; ++c) {
      const std::size_t begin = out.words.size();
      out.words.resize(begin + row_words);
      auto* bytes = reinterpret_cast<std::uint8_t*>(out.words.data() + begin);
      for (std::uint32_t t = 0; t < run.length; ++t) {
        const std::int16_t value = values[std::size_t{t} * channels + c];
        const std::int32_t centred = sample.centred(value);
        const std::int32_t squared = sample.quads() ? value : centred;
        block.squares += static_cast<std::uint64_t>(squared * squared);
        if (sample.quads()) {
          bytes[t] = static_cast<std::uint8_t>(centred);
        } else {
          const auto code = static_cast<std::int16_t>(centred);
          std::memcpy(bytes + 2 * t, &code, 2);
        }
      }
    }
  }
  return out;
}

void zone_distances(const SearchPlanes& sample, const ZoneTemplate& zone, std::uint32_t x, std::uint32_t y,
                    std::uint32_t count, std::uint64_t limit, std::uint64_t* distances) {
  HWY_DYNAMIC_DISPATCH(zone_distances_target)(sample, zone, x, y, count, limit, distances);
}

}  // namespace btfc
#endif
