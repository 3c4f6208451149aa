// zstd and XXH3 behind two small functions; the frame's header is parsed here because the profile is stricter
// than zstd's own reader.
#include "format/chunk_codec.h"

#include <fmt/format.h>
#include <xxhash.h>
#include <zstd.h>

#include <memory>

namespace btfc {
namespace {

constexpr std::uint32_t kZstdMagic = 0xFD2FB528;
constexpr std::uint64_t kMaxWindow = std::uint64_t{1} << 23;

// RFC 8878 section 3.1.1.1. Returns the broken demand of rule C1, or nullptr.
const char* frame_fault(ByteView frame, std::uint64_t raw_bytes) {
  if (frame.size() < 6 || load_u32(frame.data()) != kZstdMagic) return "no zstd frame";
  const unsigned descriptor = frame[4];
  const unsigned fcs_flag = descriptor >> 6;
  const bool single_segment = (descriptor >> 5 & 1) != 0;
  if (descriptor >> 3 & 1) return "a zstd frame with its reserved bit set";
  if (descriptor >> 2 & 1) return "a zstd frame with a content checksum";
  if (descriptor & 3) return "a zstd frame with a dictionary";
  if (fcs_flag == 0 && !single_segment) return "a zstd frame without its content size";
  const std::size_t fcs_bytes = std::size_t{1} << fcs_flag;
  const std::size_t fcs_at = single_segment ? 5 : 6;
  if (frame.size() < fcs_at + fcs_bytes) return "a truncated zstd frame";
  if (!single_segment) {
    const unsigned window_byte = frame[5];
    const std::uint64_t base = std::uint64_t{1} << (10 + (window_byte >> 3));
    if (base + base / 8 * (window_byte & 7) > kMaxWindow)
      return "a zstd frame with a window above 2^23 bytes";
  }
  std::uint64_t content = 0;
  for (std::size_t i = 0; i < fcs_bytes; ++i) content |= std::uint64_t{frame[fcs_at + i]} << (8 * i);
  if (fcs_bytes == 2) content += 256;
  if (content != raw_bytes) return "a zstd frame whose content size is not raw_bytes";
  const std::size_t frame_bytes = ZSTD_findFrameCompressedSize(frame.data(), frame.size());
  if (ZSTD_isError(frame_bytes)) return "a damaged zstd frame";
  if (frame_bytes != frame.size()) return "bytes after its zstd frame";
  return nullptr;
}

}  // namespace

std::uint64_t content_hash(ByteView bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

Result<StoredChunk> encode_chunk(ByteView raw, Codec wanted, int zstd_level) {
  StoredChunk chunk;
  if (wanted == Codec::zstd) {
    const std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    if (!context) return Error{Status::out_of_memory, "zstd could not allocate its context", "", 0};
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, zstd_level);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 0);
    // Above level 19 zstd may choose windows beyond the profile's 2^23 bytes.
    if (zstd_level > 19) ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, 23);
    chunk.stored.resize(ZSTD_compressBound(raw.size()));
    const std::size_t size =
        ZSTD_compress2(context.get(), chunk.stored.data(), chunk.stored.size(), raw.data(), raw.size());
    if (ZSTD_isError(size)) {
      return Error{Status::out_of_memory, fmt::format("zstd failed: {}", ZSTD_getErrorName(size)), "", 0};
    }
    if (size < raw.size()) {
      chunk.codec = Codec::zstd;
      chunk.stored.resize(size);
      chunk.stored.shrink_to_fit();
      return chunk;
    }
  }
  chunk.stored.assign(raw.begin(), raw.end());
  return chunk;
}

Result<Bytes> decode_chunk(ByteView stored, Codec codec, std::uint64_t raw_bytes) {
  if (codec == Codec::raw) return Bytes(stored.begin(), stored.end());
  if (const char* fault = frame_fault(stored, raw_bytes)) return invalid("C1", 0, fault);
  Bytes raw(raw_bytes);
  // A context of our own: want of memory is told from damage.
  const std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  if (!context) return Error{Status::out_of_memory, "zstd could not allocate its context", "", 0};
  const std::size_t size =
      ZSTD_decompressDCtx(context.get(), raw.data(), raw.size(), stored.data(), stored.size());
  if (ZSTD_isError(size)) return invalid("C2", 0, "a zstd frame that does not decompress");
  if (size != raw_bytes) return invalid("C2", 0, "a zstd frame that decompresses to another size");
  return raw;
}

}  // namespace btfc
