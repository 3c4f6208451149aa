// Products of rows of factors.
#pragma once
#include <cstddef>
#include <cstdint>

namespace btfc {

// Directions of a product at once; buffers are padded to it.
inline constexpr std::size_t kUbo2014Directions = 32;

// Halves, floats or doubles, little-endian at any alignment, as floats. Exact but for doubles, which are
// rounded.
void ubo2014_load_scalars(const std::uint8_t* from, std::uint32_t scalar_bytes, std::size_t count, float* to);

// sums[t * kUbo2014Directions + d] = sum over k, in order, of texels[t * components + k] *
// directions[k * kUbo2014Directions + d]. Every instruction set gives the same bits. Thread-safe.
void ubo2014_product(const float* texels, std::size_t texel_count, std::size_t components,
                     const float* directions, float* sums);

// Binary16 codes, rounded to nearest, ties to even; infinity and NaN give codes with all exponent bits.
void ubo2014_to_half(const float* values, std::size_t count, std::uint16_t* codes);

}  // namespace btfc
