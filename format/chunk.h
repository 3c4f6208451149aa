// Chunk types, keys and flags: what an index entry says, apart from where its bytes stand.
#pragma once
#include <cstdint>
#include <string>
#include <tuple>

#include "format/bytes.h"

namespace btfc {

constexpr std::uint32_t four_cc(const char (&s)[5]) {
  return static_cast<std::uint32_t>(s[0]) | static_cast<std::uint32_t>(s[1]) << 8 |
         static_cast<std::uint32_t>(s[2]) << 16 | static_cast<std::uint32_t>(s[3]) << 24;
}

inline constexpr std::uint32_t kHead = four_cc("HEAD");
inline constexpr std::uint32_t kParm = four_cc("PARM");
inline constexpr std::uint32_t kMeta = four_cc("META");

inline constexpr std::uint16_t kCritical = 1;
inline constexpr std::uint16_t kPayload = 2;
inline constexpr std::uint16_t kSafeToCopy = 4;
inline constexpr std::uint16_t kPayloadChunk = kCritical | kPayload;

enum class Codec : std::uint16_t { raw = 0, zstd = 1 };

struct ChunkKey {
  std::uint32_t type = 0;
  std::uint16_t flags = 0;
  std::uint8_t level = 0;
  std::uint8_t part = 0;
  std::uint32_t tile = 0;
  std::uint16_t item = 0;

  std::uint32_t key_a() const {
    return std::uint32_t{item} << 16 | std::uint32_t{level} << 8 | std::uint32_t{part};
  }
  // The canonical order of spec/btfc.md section 2.3, rule D6.
  auto order() const {
    const std::uint32_t chunk_class = (flags & kPayload) ? 1 : (flags & kCritical) ? 0 : 2;
    return std::tuple(chunk_class, item, level, __builtin_bswap32(type), part, tile);
  }
};

// A chunk that a model demands: its size follows from the parameters alone.
struct ChunkSpec {
  ChunkKey key;
  std::uint64_t raw_bytes = 0;
};

struct RawChunk {
  ChunkKey key;
  Bytes raw;
};

inline std::string type_name(std::uint32_t type) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(type >> (8 * i) & 0xff);
    name += c > ' ' && c < 0x7f ? c : '?';
  }
  return name;
}

}  // namespace btfc
