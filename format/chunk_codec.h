// Codecs of chunks: raw, and one zstd frame of the restricted profile (spec/btfc.md section 4).
#pragma once
#include "format/chunk.h"
#include "format/result.h"

namespace btfc {

struct StoredChunk {
  Codec codec = Codec::raw;
  Bytes stored;
};

// Compresses with zstd where that makes the chunk smaller; otherwise, or with codec raw, copies.
Result<StoredChunk> encode_chunk(ByteView raw, Codec wanted, int zstd_level);

// Undoes the codec (rules C1, C2). raw_bytes must have been checked against the derived size before.
Result<Bytes> decode_chunk(ByteView stored, Codec codec, std::uint64_t raw_bytes);

// XXH3-64 with seed 0.
std::uint64_t content_hash(ByteView bytes);

}  // namespace btfc
