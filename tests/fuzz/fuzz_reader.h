// A file of a fuzz input behind the C interface: a source that may fail, and bounds that keep an input short.
#pragma once
#include "btfc/btfc.hpp"
#include "tests/fuzz/fuzz_input.h"

namespace btfc::fuzz {

inline constexpr std::uint64_t kMostPayloadBytes = 1u << 20;
inline constexpr std::uint64_t kMostRawBytes = 16u << 20;     // of all chunks of a file
inline constexpr std::uint64_t kMostMemoryBits = 256u << 20;  // 32 MiB of words

using ReaderPtr = std::unique_ptr<btfc_reader, ReaderFree>;
using TexturePtr = std::unique_ptr<btfc_texture, TextureFree>;

// Reads of a file, of which those from one on may fail.
struct FuzzSource {
  ByteView file;
  std::uint32_t good_reads = UINT32_MAX;
  bool outside = false;  // a read beyond the file was asked for

  static int read(void* user, std::uint64_t offset, void* to, std::size_t size) {
    auto* source = static_cast<FuzzSource*>(user);
    if (offset > source->file.size() || size > source->file.size() - offset) {
      source->outside = true;
      return 1;
    }
    if (source->good_reads == 0) return 1;
    if (source->good_reads != UINT32_MAX) --source->good_reads;
    if (size != 0) std::memcpy(to, source->file.data() + offset, size);
    return 0;
  }
  btfc_source source() { return {read, this, file.size()}; }
};

inline btfc_options bounded_options() {
  btfc_options options{};
  options.struct_size = sizeof options;
  options.max_payload_bytes = kMostPayloadBytes;
  options.max_chunks = 4096;
  return options;
}

// Every error is a sentence that ends, and says a rule where a rule is broken.
inline void check_error(btfc_result result, const btfc_error& error) {
  FUZZ_CHECK(result == error.result);
  FUZZ_CHECK(std::memchr(error.rule, 0, sizeof error.rule) != nullptr);
  FUZZ_CHECK(std::memchr(error.message, 0, sizeof error.message) != nullptr);
  FUZZ_CHECK((result == BTFC_OK) == (error.message[0] == '\0'));
  FUZZ_CHECK(result != BTFC_INVALID_FILE || error.rule[0] != '\0');
}

// Whether a file is small enough to be read and loaded in a fraction of a second. Damaged numbers may ask for
// gigabytes, as the format allows: memory in proportion to what a header states is not a finding.
inline bool small_enough(const btfc_reader* reader) {
  btfc_file_info info{};
  FUZZ_CHECK(btfc_reader_info(reader, &info) == BTFC_OK);
  std::uint64_t raw = 0;
  for (std::uint32_t i = 0; i < info.chunks; ++i) {
    btfc_chunk_info chunk{};
    FUZZ_CHECK(btfc_reader_chunk_info(reader, i, &chunk) == BTFC_OK);
    raw += chunk.raw_bytes;
  }
  return raw <= kMostRawBytes && info.memory_bits <= kMostMemoryBits;
}

}  // namespace btfc::fuzz
