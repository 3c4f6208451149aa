// The container: header, index and chunks <-> bytes (spec/btfc.md sections 2 to 5).
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/chunk.h"
#include "format/domain.h"
#include "format/limits.h"
#include "format/meta.h"
#include "format/model_table.h"
#include "format/quality_curve.h"
#include "format/result.h"
#include "format/source.h"

namespace btfc {

inline constexpr std::uint16_t kVersionMajor = 0, kVersionMinor = 1;
inline constexpr std::array<std::uint8_t, 12> kMagic = {0xAB, 0x42, 0x54, 0x46, 0x43, 0x20,
                                                        0x31, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A};

struct Header {
  std::uint32_t incompatible_features = 0, compatible_features = 0;
  std::uint32_t chunk_count = 0;
  std::uint32_t align_log2 = kMinAlignLog2;
  std::uint64_t file_bytes = 0, payload_bytes = 0;
};

struct IndexEntry {
  ChunkKey key;
  Codec codec = Codec::raw;
  std::uint64_t offset = 0, stored_bytes = 0, raw_bytes = 0, raw_hash = 0;
};

struct Directory {
  Header header;
  std::vector<IndexEntry> entries;
};

// A file opened for decoding: its directory has passed every rule up to D12, its chunks have not been read.
struct OpenedFile {
  Directory directory;
  Head head;
  Bytes parm;
  Layout layout;
};

struct PackOptions {
  Codec codec = Codec::zstd;
  int zstd_level = 19;  // 1 to 22
  std::uint32_t align_log2 = kMinAlignLog2;
};

// Rules F1 to D10: two reads. Nothing is allocated before the sizes that demand it have been checked.
Result<Directory> read_directory(const ByteSource& source, const ReadLimits& limits = {});

// Rules C1 to C3 for one chunk: one read.
Result<Bytes> read_chunk(const ByteSource& source, const IndexEntry& entry);

// read_directory, then HEAD and PARM, then D11 and D12.
Result<OpenedFile> open_file(const ByteSource& source, const ReadLimits& limits = {});

// The payload's chunks, one read each. Source and file must outlive it.
ChunkReader chunk_reader(const ByteSource& source, const OpenedFile& file);

// Reads the payload and turns it into words and planes; the model's content rules.
// Chunks of a higher level than `levels` stay unread.
Result<LoadedItem> load_item(const ByteSource& source, const OpenedFile& file,
                             std::uint32_t levels = kAllLevels);

// META's entries; empty where there is none.
Result<Meta> read_file_meta(const ByteSource& source, const Directory& directory);

// What DOMN says; nothing where the file has none.
Result<std::optional<Domain>> read_file_domain(const ByteSource& source, const OpenedFile& file);

// QUAL's curve, where the file has one.
Result<std::optional<QualityCurve>> read_file_quality(const ByteSource& source, const OpenedFile& file);

// Every numbered rule of the spec, and formula == payload.
Result<Done> verify_file(const ByteSource& source, const ReadLimits& limits = {});

// All chunks, in canonical order, undone.
Result<std::vector<RawChunk>> read_all_chunks(const ByteSource& source, const Directory& directory);

// A whole file in canonical layout. Same chunks and options give the same raw hashes; with codec raw, the
// same bytes.
Result<Bytes> pack_file(std::vector<RawChunk> chunks, const PackOptions& options = {});

// Sizes of a file whose chunk i takes stored[i] bytes: Fmax with the raw sizes, F with the stored ones.
// Empty where the sum overflows 63 bits.
std::optional<std::uint64_t> file_bytes_of(const std::vector<std::uint64_t>& stored,
                                           std::uint32_t align_log2);

// Zero bytes between chunks and after the index.
std::uint64_t padding_bytes(const Directory& directory);

}  // namespace btfc
