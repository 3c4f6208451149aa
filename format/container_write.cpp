// Writing: chunks in canonical order, offsets as prefix sums, zstd only where it is smaller.
#include <fmt/format.h>

#include <algorithm>

#include "format/checked.h"
#include "format/chunk_codec.h"
#include "format/container.h"

namespace btfc {
namespace {

void store_entry(std::uint8_t* p, const IndexEntry& e) {
  store_u32(p, e.key.type);
  store_u16(p + 4, e.key.flags);
  store_u16(p + 6, static_cast<std::uint16_t>(e.codec));
  store_u64(p + 8, e.offset);
  store_u64(p + 16, e.stored_bytes);
  store_u64(p + 24, e.raw_bytes);
  store_u64(p + 32, e.raw_hash);
  store_u32(p + 40, e.key.key_a());
  store_u32(p + 44, e.key.tile);
}

void store_header(std::uint8_t* p, const Header& h) {
  std::copy(kMagic.begin(), kMagic.end(), p);
  store_u16(p + 12, kVersionMajor);
  store_u16(p + 14, kVersionMinor);
  store_u32(p + 16, h.incompatible_features);
  store_u32(p + 20, h.compatible_features);
  store_u32(p + 24, h.chunk_count);
  store_u32(p + 28, h.align_log2);
  store_u64(p + 32, h.file_bytes);
  store_u64(p + 40, h.payload_bytes);
}

}  // namespace

std::optional<std::uint64_t> file_bytes_of(const std::vector<std::uint64_t>& stored,
                                           std::uint32_t align_log2) {
  CheckedSize end = CheckedSize(kHeaderBytes) + CheckedSize(kIndexEntryBytes) * CheckedSize(stored.size());
  for (const std::uint64_t bytes : stored) end = align_up(end, align_log2) + CheckedSize(bytes);
  if (!end.valid() || end.value() >> 63 != 0) return std::nullopt;
  return end.value();
}

std::uint64_t padding_bytes(const Directory& directory) {
  std::uint64_t used = kHeaderBytes + std::uint64_t{kIndexEntryBytes} * directory.entries.size();
  for (const IndexEntry& e : directory.entries) used += e.stored_bytes;
  return directory.header.file_bytes - used;
}

Result<Bytes> pack_file(std::vector<RawChunk> chunks, const PackOptions& options) {
  if (options.align_log2 < kMinAlignLog2 || options.align_log2 > kMaxAlignLog2) {
    return bad_argument(fmt::format("alignment is 2^{}, expected 2^4 to 2^16", options.align_log2));
  }
  if (chunks.empty() || chunks.size() > kMaxChunks) {
    return bad_argument(fmt::format("{} chunks, expected 1 to 2^20", chunks.size()));
  }
  std::sort(chunks.begin(), chunks.end(),
            [](const RawChunk& a, const RawChunk& b) { return a.key.order() < b.key.order(); });

  std::vector<StoredChunk> stored;
  std::vector<IndexEntry> entries;
  std::vector<std::uint64_t> sizes;
  Header header;
  header.align_log2 = options.align_log2;
  header.chunk_count = static_cast<std::uint32_t>(chunks.size());
  for (RawChunk& chunk : chunks) {
    if (chunk.raw.empty() || chunk.raw.size() > kMaxChunkBytes) {
      return bad_argument(fmt::format("chunk '{}' has {} bytes, expected 1 to 2^27",
                                      type_name(chunk.key.type), chunk.raw.size()));
    }
    Result<StoredChunk> one = encode_chunk(chunk.raw, options.codec, options.zstd_level);
    if (!one) return one.error();
    IndexEntry e;
    e.key = chunk.key;
    e.codec = one->codec;
    e.stored_bytes = one->stored.size();
    e.raw_bytes = chunk.raw.size();
    e.raw_hash = content_hash(chunk.raw);
    if (e.key.flags & kPayload) header.payload_bytes += e.raw_bytes;
    sizes.push_back(e.stored_bytes);
    entries.push_back(e);
    stored.push_back(*std::move(one));
    Bytes().swap(chunk.raw);  // one copy of the data at a time
  }
  const auto total = file_bytes_of(sizes, options.align_log2);
  if (!total) return bad_argument("the file would exceed 2^63 bytes");
  header.file_bytes = *total;

  Bytes file(header.file_bytes);
  store_header(file.data(), header);
  std::uint64_t end = kHeaderBytes + std::uint64_t{kIndexEntryBytes} * entries.size();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i].offset = align_up(end, options.align_log2).value();
    end = entries[i].offset + entries[i].stored_bytes;
    store_entry(&file[kHeaderBytes + kIndexEntryBytes * i], entries[i]);
    std::copy(stored[i].stored.begin(), stored[i].stored.end(),
              file.begin() + static_cast<std::ptrdiff_t>(entries[i].offset));
  }
  Bytes hashed(file.begin(), file.begin() + 56);
  hashed.insert(hashed.end(), file.begin() + kHeaderBytes,
                file.begin() + kHeaderBytes + static_cast<std::ptrdiff_t>(kIndexEntryBytes * entries.size()));
  store_u64(&file[56], content_hash(hashed));
  return file;
}

}  // namespace btfc
