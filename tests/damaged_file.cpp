// Implementation: the directory is written again from what its entries say.
#include "tests/damaged_file.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "format/checked.h"
#include "format/chunk_codec.h"

namespace btfc::test {
namespace {

void store_directory(Bytes& file, const Parts& parts) {
  store_u32(&file[24], static_cast<std::uint32_t>(parts.entries.size()));
  store_u64(&file[32], file.size());
  std::uint64_t payload = 0;
  for (std::size_t i = 0; i < parts.entries.size(); ++i) {
    const IndexEntry& e = parts.entries[i];
    std::uint8_t* p = &file[kHeaderBytes + kIndexEntryBytes * i];
    store_u32(p, e.key.type);
    store_u16(p + 4, e.key.flags);
    store_u16(p + 6, static_cast<std::uint16_t>(e.codec));
    store_u64(p + 8, e.offset);
    store_u64(p + 16, e.stored_bytes);
    store_u64(p + 24, e.raw_bytes);
    store_u64(p + 32, e.raw_hash);
    store_u32(p + 40, e.key.key_a());
    store_u32(p + 44, e.key.tile);
    if (e.key.flags & kPayload) payload += e.raw_bytes;
  }
  store_u64(&file[40], payload);
}

void store_directory_hash(Bytes& file, std::size_t entries) {
  Bytes hashed(file.begin(), file.begin() + 56);
  hashed.insert(hashed.end(), file.begin() + kHeaderBytes,
                file.begin() + static_cast<std::ptrdiff_t>(kHeaderBytes + kIndexEntryBytes * entries));
  store_u64(&file[56], content_hash(hashed));
}

}  // namespace

ByteSource source_of(const ByteView& bytes) { return memory_source(&bytes); }

Result<OpenedFile> open_bytes(const Bytes& file) {
  const ByteView view(file);
  return open_file(source_of(view));
}

Result<Done> verify_bytes(const Bytes& file) {
  const ByteView view(file);
  return verify_file(source_of(view));
}

void repair_hashes(Bytes& file) {
  if (file.size() < kHeaderBytes) return;
  const std::uint64_t count = load_u32(&file[24]);
  if (kHeaderBytes + kIndexEntryBytes * count > file.size()) return;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint8_t* p = &file[kHeaderBytes + kIndexEntryBytes * i];
    const std::uint64_t offset = load_u64(p + 8), stored = load_u64(p + 16), raw_bytes = load_u64(p + 24);
    if (offset > file.size() || stored > file.size() - offset || raw_bytes > kMaxChunkBytes) continue;
    const unsigned codec = load_u16(p + 6);
    if (codec > 1) continue;
    const Result<Bytes> raw =
        decode_chunk({file.data() + offset, stored}, static_cast<Codec>(codec), raw_bytes);
    if (raw) store_u64(p + 32, content_hash(*raw));
  }
  store_directory_hash(file, count);
}

Parts take_apart(const Bytes& file) {
  Parts parts;
  const ByteView view(file);
  Result<Directory> directory = read_directory(source_of(view));
  if (!directory) {
    std::fprintf(stderr, "take_apart: %s\n", directory.error().message.c_str());
    std::abort();  // a test that damages files begins with a sound one
  }
  parts.header = directory->header;
  parts.entries = directory->entries;
  for (const IndexEntry& e : parts.entries) {
    const auto from = file.begin() + static_cast<std::ptrdiff_t>(e.offset);
    parts.stored.emplace_back(from, from + static_cast<std::ptrdiff_t>(e.stored_bytes));
  }
  return parts;
}

Bytes put_together(const Parts& parts) {
  Parts p = parts;
  std::uint64_t end = kHeaderBytes + kIndexEntryBytes * p.entries.size();
  for (std::size_t i = 0; i < p.entries.size(); ++i) {
    IndexEntry& e = p.entries[i];
    e.offset = align_up(end, p.header.align_log2).value();
    e.stored_bytes = p.stored[i].size();
    if (e.codec == Codec::raw) {
      e.raw_bytes = e.stored_bytes;
      e.raw_hash = content_hash(p.stored[i]);
    }
    end = e.offset + e.stored_bytes;
  }
  Bytes file(end);
  std::copy(kMagic.begin(), kMagic.end(), file.begin());
  store_u16(&file[12], kVersionMajor);
  store_u16(&file[14], kVersionMinor);
  store_u32(&file[16], p.header.incompatible_features);
  store_u32(&file[20], p.header.compatible_features);
  store_u32(&file[28], p.header.align_log2);
  store_directory(file, p);
  for (std::size_t i = 0; i < p.entries.size(); ++i) {
    std::copy(p.stored[i].begin(), p.stored[i].end(),
              file.begin() + static_cast<std::ptrdiff_t>(p.entries[i].offset));
  }
  store_directory_hash(file, p.entries.size());
  return file;
}

}  // namespace btfc::test
