// The caps of spec/btfc.md section 8: they keep every size product below 2^63.
#pragma once
#include <cstdint>

namespace btfc {

inline constexpr std::uint32_t kHeaderBytes = 64;
inline constexpr std::uint32_t kIndexEntryBytes = 48;
inline constexpr std::uint32_t kMaxChunks = 1u << 20;
inline constexpr std::uint64_t kMaxChunkBytes = 1u << 27;
inline constexpr std::uint32_t kMaxSide = 65536;
inline constexpr std::uint32_t kMaxMaps = 16;
inline constexpr std::uint32_t kMaxChannels = 16;
inline constexpr std::uint32_t kMaxDirections = 1u << 16;
inline constexpr std::uint32_t kMaxPairs = 1u << 20;
inline constexpr std::uint64_t kMaxParmBytes = 4096;
inline constexpr std::uint64_t kMaxMetaBytes = 1u << 20;
inline constexpr std::uint32_t kMinAlignLog2 = 4;
inline constexpr std::uint32_t kMaxAlignLog2 = 16;

// What a reader is willing to hold, set by its caller; files above are refused with Status::limit.
struct ReadLimits {
  std::uint64_t max_payload_bytes = std::uint64_t{1} << 32;
  std::uint32_t max_chunks = kMaxChunks;
};

}  // namespace btfc
