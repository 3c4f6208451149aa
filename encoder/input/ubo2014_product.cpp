// The product with Highway: one binary, the best instruction set found at run time. A lane is a direction and
// there are no fused operations, so that the sums have the same bits everywhere.
#include "encoder/input/ubo2014_product.h"

#include <bit>

#include "encoder/input/ubo2014_file.h"
#include "shaders/btfc_half.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/input/ubo2014_product.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, kUbo2014Directions / 2>;

// kTexels rows by two vectors of directions: their sums stay in registers.
template <std::size_t kTexels>
void product_tile(const float* texels, std::size_t components, const float* directions, float* sums) {
  const Lanes d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t p = 0; p < kUbo2014Directions; p += 2 * lanes) {
    hn::Vec<Lanes> a0 = hn::Zero(d), a1 = a0, b0 = a0, b1 = a0, c0 = a0, c1 = a0, e0 = a0, e1 = a0;
    for (std::size_t k = 0; k < components; ++k) {
      const auto v0 = hn::LoadU(d, directions + k * kUbo2014Directions + p);
      const auto v1 = hn::LoadU(d, directions + k * kUbo2014Directions + p + lanes);
      const auto add = [&](std::size_t t, auto& s0, auto& s1) {
        const auto texel = hn::Set(d, texels[t * components + k]);
        s0 = hn::Add(s0, hn::Mul(texel, v0));
        s1 = hn::Add(s1, hn::Mul(texel, v1));
      };
      add(0, a0, a1);
      if constexpr (kTexels == 4) {
        add(1, b0, b1);
        add(2, c0, c1);
        add(3, e0, e1);
      }
    }
    const auto keep = [&](std::size_t t, auto s0, auto s1) {
      hn::StoreU(s0, d, sums + t * kUbo2014Directions + p);
      hn::StoreU(s1, d, sums + t * kUbo2014Directions + p + lanes);
    };
    keep(0, a0, a1);
    if constexpr (kTexels == 4) {
      keep(1, b0, b1);
      keep(2, c0, c1);
      keep(3, e0, e1);
    }
  }
}

void product_target(const float* texels, std::size_t texel_count, std::size_t components,
                    const float* directions, float* sums) {
  std::size_t t = 0;
  for (; t + 4 <= texel_count; t += 4) {
    product_tile<4>(texels + t * components, components, directions, sums + t * kUbo2014Directions);
  }
  for (; t < texel_count; ++t) {
    product_tile<1>(texels + t * components, components, directions, sums + t * kUbo2014Directions);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(product_target);

void ubo2014_product(const float* texels, std::size_t texel_count, std::size_t components,
                     const float* directions, float* sums) {
  HWY_DYNAMIC_DISPATCH(product_target)(texels, texel_count, components, directions, sums);
}

void ubo2014_load_scalars(const std::uint8_t* from, std::uint32_t scalar_bytes, std::size_t count,
                          float* to) {
  if (scalar_bytes == 2) {
    // As btfc_half_to_float, without a branch: the exponent's bias by a product, which is exact.
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t h = load_u16(from + 2 * i);
      const float magnitude = std::bit_cast<float>((h & 0x7fffu) << 13) * 0x1p112f;
      const std::uint32_t infinite = (h & 0x7c00u) == 0x7c00u ? 0x7f800000u : 0u;
      to[i] = std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) | infinite | (h & 0x8000u) << 16);
    }
  } else if (scalar_bytes == 4) {
    for (std::size_t i = 0; i < count; ++i) to[i] = load_f32(from + 4 * i);
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<float>(std::bit_cast<double>(load_u64(from + 8 * i)));
    }
  }
}

void ubo2014_to_half(const float* values, std::size_t count, std::uint16_t* codes) {
  // As btfc_float_to_half, without a branch.
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(values[i]);
    const std::uint32_t magnitude = bits & 0x7fffffffu;
    const std::uint32_t normal = (magnitude + 0x0fffu + ((magnitude >> 13) & 1u) - 0x38000000u) >> 13;
    // Below 2^-14 the last place is 2^-24: adding 0.5 rounds to it and leaves the code in the low bits.
    const std::uint32_t small =
        std::bit_cast<std::uint32_t>(std::bit_cast<float>(magnitude) + 0.5f) - 0x3f000000u;
    std::uint32_t code = magnitude < 0x38800000u ? small : normal;
    code = magnitude >= 0x477ff000u ? 0x7c00u : code;
    code = magnitude > 0x7f800000u ? 0x7e00u : code;
    codes[i] = static_cast<std::uint16_t>(code | (bits >> 16 & 0x8000u));
  }
}

}  // namespace btfc
#endif
