// Little-endian loads and stores on byte arrays, independent of the host's byte order.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace btfc {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

inline std::uint16_t load_u16(const std::uint8_t* p) {
  return static_cast<std::uint16_t>(p[0] | static_cast<unsigned>(p[1]) << 8);
}
inline std::uint32_t load_u32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 |
         std::uint32_t{p[3]} << 24;
}
inline std::uint64_t load_u64(const std::uint8_t* p) {
  return std::uint64_t{load_u32(p)} | std::uint64_t{load_u32(p + 4)} << 32;
}
inline void store_u16(std::uint8_t* p, std::uint16_t v) {
  p[0] = static_cast<std::uint8_t>(v);
  p[1] = static_cast<std::uint8_t>(v >> 8);
}
inline void store_u32(std::uint8_t* p, std::uint32_t v) {
  for (int i = 0; i < 4; ++i) p[i] = static_cast<std::uint8_t>(v >> (8 * i));
}
inline float load_f32(const std::uint8_t* p) { return std::bit_cast<float>(load_u32(p)); }
inline void store_u64(std::uint8_t* p, std::uint64_t v) {
  for (int i = 0; i < 8; ++i) p[i] = static_cast<std::uint8_t>(v >> (8 * i));
}
inline void store_f32(std::uint8_t* p, float v) { store_u32(p, std::bit_cast<std::uint32_t>(v)); }

// The bytes as words; a last partial word is filled up with zero.
inline std::vector<std::uint32_t> to_words(ByteView bytes) {
  std::vector<std::uint32_t> words((bytes.size() + 3) / 4);
  const std::size_t whole = bytes.size() / 4;
  for (std::size_t i = 0; i < whole; ++i) words[i] = load_u32(bytes.data() + 4 * i);
  for (std::size_t i = 4 * whole; i < bytes.size(); ++i)
    words[i / 4] |= std::uint32_t{bytes[i]} << (8 * (i % 4));
  return words;
}
inline Bytes from_words(std::span<const std::uint32_t> words) {
  Bytes bytes(4 * words.size());
  for (std::size_t i = 0; i < words.size(); ++i) store_u32(bytes.data() + 4 * i, words[i]);
  return bytes;
}

}  // namespace btfc
