// Inner loops of patch_rows.cpp, included once for each instruction set (Highway). Plain where the compiler
// vectorises.

#if defined(BTFC_PATCH_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BTFC_PATCH_KERNELS_INL_H
#undef BTFC_PATCH_KERNELS_INL_H
#else
#define BTFC_PATCH_KERNELS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "format/head.h"
#include "shaders/models/patch.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A vector of any instruction set.
inline constexpr std::size_t kSlack = HWY_MAX_BYTES;

// Copies size bytes, at most `most`. Where room and readable bytes from out and source on allow it, always as
// many vectors as `most` bytes take, since a count that changed from run to run would be mispredicted; what
// is written too much is overwritten by the run that follows.
HWY_INLINE void copy_run(std::uint8_t* out, const std::uint8_t* source, std::size_t size, std::size_t most,
                         std::size_t room, std::size_t readable) {
#if HWY_TARGET != HWY_SCALAR
  const hn::ScalableTag<std::uint8_t> d;
  if (std::min(room, readable) >= most + hn::Lanes(d)) {
    for (std::size_t b = 0; b < most; b += hn::Lanes(d)) hn::StoreU(hn::LoadU(d, source + b), d, out + b);
    return;
  }
#endif
  (void)most;
  (void)room;
  (void)readable;
  std::memcpy(out, source, size);
}

// out[s] = limits[s] > v ? above[s] : here[s] over samples, in vectors as copy_run does it; above and limits
// may be read as far.
template <class Sample, class Limit>
HWY_INLINE void select_run(std::uint8_t* out_bytes, const std::uint8_t* above_bytes,
                           const std::uint8_t* here_bytes, const Limit* limits, std::uint32_t v,
                           std::size_t samples, std::size_t most, std::size_t room, std::size_t readable) {
  const auto* above = reinterpret_cast<const Sample*>(above_bytes);
  const auto* here = reinterpret_cast<const Sample*>(here_bytes);
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(Limit) <= sizeof(Sample)) {
    const hn::ScalableTag<Sample> d;
    if (std::min(room, readable) >= (most + hn::Lanes(d)) * sizeof(Sample)) {
      auto* out = reinterpret_cast<Sample*>(out_bytes);
      const hn::Rebind<Limit, decltype(d)> d_limit;
      const auto row = hn::Set(d, static_cast<Sample>(v));
      for (std::size_t s = 0; s < most; s += hn::Lanes(d)) {
        const auto choose = [&](auto limit) {
          hn::StoreU(hn::IfThenElse(hn::Gt(limit, row), hn::LoadU(d, above + s), hn::LoadU(d, here + s)), d,
                     out + s);
        };
        if constexpr (sizeof(Limit) == sizeof(Sample)) {
          choose(hn::LoadU(d_limit, limits + s));
        } else {
          choose(hn::PromoteTo(d, hn::LoadU(d_limit, limits + s)));
        }
      }
      return;
    }
  }
#endif
  (void)most;
  (void)room;
  (void)readable;
  const auto row = static_cast<Limit>(v);
  for (std::size_t s = 0; s < samples; ++s) {  // the caller's rows may lie at odd addresses
    const Sample* from = limits[s] > row ? above + s : here + s;
    std::memcpy(out_bytes + s * sizeof(Sample), from, sizeof(Sample));
  }
}

// Entries 0 … count-1 of a cut of `bits` bits each, as patch_cut without its branches. out has kSlack bytes
// behind its end.
template <class Entry>
HWY_INLINE void unpack_cut(const std::uint32_t* words, std::size_t word_count, std::size_t first_bit,
                           std::uint32_t bits, std::uint32_t count, Entry* out) {
  std::uint32_t t = 0;
#if HWY_ARCH_X86_64 && HWY_TARGET <= HWY_AVX2  // these targets have BMI2
  // Eight entries from one word of 64 bits, spread over its bytes; little-endian.
  if constexpr (sizeof(Entry) == 1) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(words);
    const std::uint64_t spread = 0x0101010101010101u * ((std::uint64_t{1} << bits) - 1);
    for (; bits < 8 && t < count; t += 8) {
      const std::size_t bit = first_bit + std::size_t{t} * bits;
      if ((bit >> 3) + 8 > 4 * word_count) break;
      std::uint64_t packed;
      std::memcpy(&packed, bytes + (bit >> 3), 8);
      packed = _pdep_u64(packed >> (bit & 7), spread);
      std::memcpy(out + t, &packed, 8);
    }
  }
#endif
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  for (; t < count; ++t) {
    const std::size_t bit = first_bit + std::size_t{t} * bits, word = bit >> 5;
    const std::uint64_t next = word + 1 < word_count ? words[word + 1] : 0;
    out[t] = static_cast<Entry>((words[word] | next << 32) >> (bit & 31) & mask);
  }
}

// Each of count entries `times` times, 1 to 4. out has kSlack bytes behind its end for each time.
template <class Entry>
HWY_INLINE void repeat_entries(const Entry* entries, std::uint32_t count, std::uint32_t times, Entry* out) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(Entry) == 1) {
    const hn::ScalableTag<Entry> d;
    for (std::uint32_t t = 0; t < count; t += static_cast<std::uint32_t>(hn::Lanes(d))) {
      const auto e = hn::LoadU(d, entries + t);
      if (times == 1) hn::StoreU(e, d, out + t);
      if (times == 2) hn::StoreInterleaved2(e, e, d, out + 2 * t);
      if (times == 3) hn::StoreInterleaved3(e, e, e, d, out + 3 * t);
      if (times == 4) hn::StoreInterleaved4(e, e, e, e, d, out + 4 * t);
    }
    return;
  }
#endif
  for (std::uint32_t t = 0; t < count; ++t) std::fill_n(out + std::size_t{t} * times, times, entries[t]);
}

// Weights as lerp_samples reads them.
struct LerpFactors {
  const std::uint16_t* plain;
  const std::int8_t* pairs;  // null: none
  std::size_t step;          // 0 where all samples have one weight
};

// Feathering weights of samples 0 … count-1, from 0 to 256 in 1/256, ready for lerp_samples.
struct LerpWeights {
  std::vector<std::uint16_t> plain;
  // For 32 samples at a time the factors of a and b less 128, as the instruction takes them (below); empty
  // where a weight of 0 or 256 does not fit.
  std::vector<std::int8_t> pairs;
  bool uniform = false;  // all weights are plain[0]: as many are held as a vector takes

  void assign_uniform(std::uint32_t weight) {
    assign(kSlack, [&](std::size_t) { return weight; });
    uniform = true;
  }
  LerpFactors factors() const {
    return {plain.data(), pairs.empty() ? nullptr : pairs.data(), uniform ? std::size_t{0} : std::size_t{1}};
  }

  void assign(std::size_t count, auto&& weight) {
    plain.assign(count + kSlack, 0);
    pairs.assign((count + 31) / 32 * 64, 0);
    bool fit = true;
    for (std::size_t s = 0; s < count; ++s) {
      const std::uint32_t w = weight(s);
      plain[s] = static_cast<std::uint16_t>(w);
      fit = fit && w > 0 && w < 256;
      // Sample k of 32: in each half of 16 the first eight, then the others, each as a pair.
      const std::size_t k = s % 32, place = s / 32 * 64 + k / 8 % 2 * 32 + k / 16 * 16 + k % 8 * 2;
      pairs[place] = static_cast<std::int8_t>(128 - static_cast<int>(w));
      pairs[place + 1] = static_cast<std::int8_t>(static_cast<int>(w) - 128);
    }
    if (!fit) pairs.clear();
  }
};

// out[s] = lerp(a[s], b[s], weight of sample first + s), spec/models/patch.md section 5. out may be a or b.
// Whole vectors are used as far as room and readable bytes from out, and from a and b, allow it; what is
// written too much is overwritten by what follows.
HWY_INLINE void lerp_samples(SampleType type, std::uint8_t* out, const std::uint8_t* a, const std::uint8_t* b,
                             const LerpFactors weights, std::size_t first, std::size_t samples,
                             std::size_t room, std::size_t readable) {
  std::size_t s = 0;
  const std::uint16_t* plain = weights.plain + first;
  const std::size_t step = weights.step;
  if (type == SampleType::unorm8) {
    const std::size_t end = std::min(room, readable);
#if HWY_ARCH_X86_64 && HWY_TARGET <= HWY_AVX2
    // a (256 - w) + b w = 128 (a + b) + a (128 - w) + b (w - 128); the last two fit 16 bits, the sum does
    // modulo 2^16.
    if (first == 0 && weights.pairs != nullptr) {
      const auto* factors = reinterpret_cast<const __m256i*>(weights.pairs);
      const __m256i ones = _mm256_set1_epi8(1), half = _mm256_set1_epi16(128);
      const auto blend = [&](__m256i both, __m256i factor) {
        const __m256i middle = _mm256_slli_epi16(_mm256_maddubs_epi16(both, ones), 7);
        const __m256i sum =
            _mm256_add_epi16(_mm256_add_epi16(middle, half), _mm256_maddubs_epi16(both, factor));
        return _mm256_srli_epi16(sum, 8);
      };
      for (; s < samples && s + 32 <= end; s += 32, factors += 2 * step) {
        const __m256i left = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + s));
        const __m256i right = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(b + s));
        const __m256i low = blend(_mm256_unpacklo_epi8(left, right), _mm256_loadu_si256(factors));
        const __m256i high = blend(_mm256_unpackhi_epi8(left, right), _mm256_loadu_si256(factors + 1));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + s), _mm256_packus_epi16(low, high));
      }
    }
#endif
#if HWY_TARGET != HWY_SCALAR
    // Exact modulo 2^16: the sum lies in 0 … 65408.
    const hn::ScalableTag<std::uint16_t> d16;
    const hn::Rebind<std::uint8_t, decltype(d16)> d8;
    const hn::RebindToSigned<decltype(d16)> d_signed;
    const auto round = hn::Set(d16, 128);
    for (; s < samples && s + hn::Lanes(d16) <= end; s += hn::Lanes(d16)) {
      const auto left = hn::PromoteTo(d16, hn::LoadU(d8, a + s)),
                 right = hn::PromoteTo(d16, hn::LoadU(d8, b + s));
      const auto product = hn::Mul(hn::Sub(right, left), hn::LoadU(d16, plain + s * step));
      const auto sum = hn::ShiftRight<8>(hn::Add(hn::Add(hn::ShiftLeft<8>(left), product), round));
      hn::StoreU(hn::DemoteTo(d8, hn::BitCast(d_signed, sum)), d8, out + s);
    }
#endif
    (void)end;
    for (; s < samples; ++s) {
      out[s] = static_cast<std::uint8_t>(patch_lerp_code(BTFC_CODE_UNORM8, a[s], b[s], plain[s * step]));
    }
    return;
  }
  for (; s < samples; ++s) {
    std::uint16_t left, right;
    std::memcpy(&left, a + 2 * s, 2);
    std::memcpy(&right, b + 2 * s, 2);
    const auto code =
        static_cast<std::uint16_t>(patch_lerp_code(static_cast<uint>(type), left, right, plain[s * step]));
    std::memcpy(out + 2 * s, &code, 2);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#endif  // include guard of each target
