// Inner loops of patch_rows.cpp, included once for each instruction set (Highway). Plain where the compiler
// vectorises.

#if defined(BTFC_PATCH_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BTFC_PATCH_KERNELS_INL_H
#undef BTFC_PATCH_KERNELS_INL_H
#else
#define BTFC_PATCH_KERNELS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "format/head.h"
#include "shaders/models/patch.h"

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Bytes that copy_run may write and read beyond the end.
inline constexpr std::size_t kSlack = HWY_MAX_BYTES;

// Copies whole vectors; what it writes too much is overwritten by the run that follows. source_end bounds
// what may be read.
HWY_INLINE void copy_run(std::uint8_t* out, const std::uint8_t* source, std::size_t size,
                         const std::uint8_t* source_end) {
#if HWY_TARGET != HWY_SCALAR
  if (static_cast<std::size_t>(source_end - source) >= size + kSlack) {
    const hn::ScalableTag<std::uint8_t> d;
    for (std::size_t b = 0; b < size; b += hn::Lanes(d)) hn::StoreU(hn::LoadU(d, source + b), d, out + b);
    return;
  }
#endif
  (void)source_end;
  std::memcpy(out, source, size);
}

// out[t] = limits[t] > v ? above[t] : out[t]. The arrays of texels have kSlack bytes behind their end, limits
// too.
template <class Texel, class Limit>
HWY_INLINE void select_texels(std::uint8_t* out_bytes, const std::uint8_t* above_bytes, const Limit* limits,
                              std::uint32_t v, std::size_t count) {
  auto* out = reinterpret_cast<Texel*>(out_bytes);
  const auto* above = reinterpret_cast<const Texel*>(above_bytes);
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(Texel) == 4) {
    const hn::ScalableTag<Texel> d;
    const hn::Rebind<Limit, decltype(d)> d_limit;
    const auto row = hn::Set(d, static_cast<Texel>(v));
    for (std::size_t t = 0; t < count; t += hn::Lanes(d)) {
      const auto shows_above = hn::Gt(hn::PromoteTo(d, hn::LoadU(d_limit, limits + t)), row);
      hn::StoreU(hn::IfThenElse(shows_above, hn::LoadU(d, above + t), hn::LoadU(d, out + t)), d, out + t);
    }
    return;
  }
#endif
  const auto row = static_cast<Limit>(v);
  for (std::size_t t = 0; t < count; ++t) out[t] = limits[t] > row ? above[t] : out[t];
}

template <class Limit>
HWY_INLINE void select_above(std::uint8_t* out, const std::uint8_t* above, const Limit* limits,
                             std::uint32_t v, std::size_t count, std::uint32_t texel_bytes) {
  if (texel_bytes == 1) select_texels<std::uint8_t>(out, above, limits, v, count);
  if (texel_bytes == 2) select_texels<std::uint16_t>(out, above, limits, v, count);
  if (texel_bytes == 4) select_texels<std::uint32_t>(out, above, limits, v, count);
  if (texel_bytes == 8) select_texels<std::uint64_t>(out, above, limits, v, count);
}

// out[s] = lerp(a[s], b[s], weights[s]) over samples, spec/models/patch.md section 5. out may be a or b, and
// it and weights have kSlack elements behind their end; readable: bytes that may be read from a and from b.
HWY_INLINE void lerp_samples(SampleType type, std::uint8_t* out, const std::uint8_t* a, const std::uint8_t* b,
                             const std::uint16_t* weights, std::size_t samples, std::size_t readable) {
  if (type == SampleType::unorm8) {
#if HWY_TARGET != HWY_SCALAR
    if (readable >= samples + kSlack) {
      // Exact modulo 2^16: the sum lies in 0 … 65408.
      const hn::ScalableTag<std::uint16_t> d16;
      const hn::Rebind<std::uint8_t, decltype(d16)> d8;
      const hn::RebindToSigned<decltype(d16)> d_signed;
      const auto half = hn::Set(d16, 128);
      for (std::size_t s = 0; s < samples; s += hn::Lanes(d16)) {
        const auto left = hn::PromoteTo(d16, hn::LoadU(d8, a + s)),
                   right = hn::PromoteTo(d16, hn::LoadU(d8, b + s));
        const auto product = hn::Mul(hn::Sub(right, left), hn::LoadU(d16, weights + s));
        const auto sum = hn::ShiftRight<8>(hn::Add(hn::Add(hn::ShiftLeft<8>(left), product), half));
        hn::StoreU(hn::DemoteTo(d8, hn::BitCast(d_signed, sum)), d8, out + s);
      }
      return;
    }
#endif
    for (std::size_t s = 0; s < samples; ++s) {
      out[s] = static_cast<std::uint8_t>(patch_lerp_code(BTFC_CODE_UNORM8, a[s], b[s], weights[s]));
    }
    return;
  }
  (void)readable;
  for (std::size_t s = 0; s < samples; ++s) {
    std::uint16_t left, right;
    std::memcpy(&left, a + 2 * s, 2);
    std::memcpy(&right, b + 2 * s, 2);
    const auto code =
        static_cast<std::uint16_t>(patch_lerp_code(static_cast<uint>(type), left, right, weights[s]));
    std::memcpy(out + 2 * s, &code, 2);
  }
}

// Texels of four samples to texels of three. In each 16 bytes the 12 wanted ones move to the front; then
// these three words of each 16 bytes move together.
class PackThree {
 public:
  explicit PackThree(std::size_t sample_bytes) : in_(4 * sample_bytes), wanted_(3 * sample_bytes) {
    for (std::size_t i = 0; i < HWY_MAX_BYTES; ++i) {
      const std::size_t k = i % 16;
      order_[i] = k < 12 ? static_cast<std::uint8_t>(k / wanted_ * in_ + k % wanted_) : std::uint8_t{0x80};
    }
#if HWY_TARGET != HWY_SCALAR
    const std::size_t words = hn::Lanes(hn::ScalableTag<std::uint32_t>());
    for (std::size_t i = 0; i < words; ++i) {
      place_[i] = static_cast<std::int32_t>(i < words * 3 / 4 ? i / 3 * 4 + i % 3 : words - 1);
    }
#endif
  }

  // Writes up to room bytes, of which those after the texels are to be overwritten by what follows.
  // source_end bounds what may be read.
  HWY_INLINE void operator()(std::uint8_t* out, const std::uint8_t* source, std::size_t texels,
                             std::size_t room, const std::uint8_t* source_end) const {
    std::size_t t = 0;
#if HWY_TARGET != HWY_SCALAR
    const hn::ScalableTag<std::uint8_t> d8;
    const hn::ScalableTag<std::uint32_t> d32;
    const std::size_t bytes = hn::Lanes(d8), at_once = bytes / in_;
    const auto shuffle = hn::Load(d8, order_);
    const auto together = hn::SetTableIndices(d32, place_);
    const auto readable = static_cast<std::size_t>(source_end - source);
    for (; t < texels && room >= t * wanted_ + bytes && readable >= t * in_ + bytes; t += at_once) {
      const auto packed = hn::TableLookupBytes(hn::LoadU(d8, source + t * in_), shuffle);
      const auto moved = hn::TableLookupLanes(hn::BitCast(d32, packed), together);
      hn::StoreU(hn::BitCast(d8, moved), d8, out + t * wanted_);
    }
#endif
    (void)room;
    (void)source_end;
    for (; t < texels; ++t) {  // constant sizes, so that no call is made for a texel
      if (wanted_ == 3) {
        std::memcpy(out + 3 * t, source + 4 * t, 3);
      } else {
        std::memcpy(out + 6 * t, source + 8 * t, 6);
      }
    }
  }

 private:
  std::size_t in_, wanted_;
  HWY_ALIGN std::uint8_t order_[HWY_MAX_BYTES];
  HWY_ALIGN std::int32_t place_[HWY_MAX_BYTES / 4];
};

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#endif  // include guard of each target
