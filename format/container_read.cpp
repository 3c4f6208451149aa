// Reading: every rule is checked before the number it guards is used.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "format/checked.h"
#include "format/chunk_codec.h"
#include "format/container.h"

namespace btfc {
namespace {

Error short_read(std::uint64_t offset, std::uint64_t size) {
  return {Status::io, fmt::format("could not read {} bytes at {}", size, offset), "", offset};
}

IndexEntry parse_entry(const std::uint8_t* p) {
  IndexEntry e;
  e.key.type = load_u32(p);
  e.key.flags = load_u16(p + 4);
  e.codec = static_cast<Codec>(load_u16(p + 6));
  e.offset = load_u64(p + 8);
  e.stored_bytes = load_u64(p + 16);
  e.raw_bytes = load_u64(p + 24);
  e.raw_hash = load_u64(p + 32);
  const std::uint32_t key_a = load_u32(p + 40);
  e.key.item = static_cast<std::uint16_t>(key_a >> 16);
  e.key.level = static_cast<std::uint8_t>(key_a >> 8);
  e.key.part = static_cast<std::uint8_t>(key_a);
  e.key.tile = load_u32(p + 44);
  return e;
}

// Rules F1 to F8 on the header's 64 bytes.
Result<Header> parse_header(const std::uint8_t* p, std::uint64_t size) {
  if (!std::equal(kMagic.begin(), kMagic.end(), p)) {
    return invalid("F2", 0, "not a btfc file: the first 12 bytes are not its magic");
  }
  const unsigned major = load_u16(p + 12), minor = load_u16(p + 14);
  if (major != kVersionMajor || minor != kVersionMinor) {
    return unsupported("F3", 12,
                       fmt::format("format version is {}.{}, this reader knows {}.{}", major, minor,
                                   kVersionMajor, kVersionMinor));
  }
  Header h;
  h.incompatible_features = load_u32(p + 16);
  h.compatible_features = load_u32(p + 20);
  h.chunk_count = load_u32(p + 24);
  h.align_log2 = load_u32(p + 28);
  h.file_bytes = load_u64(p + 32);
  h.payload_bytes = load_u64(p + 40);
  if (h.incompatible_features != 0) {
    return unsupported("F4", 16,
                       fmt::format("incompatible feature bits {:#x} are set, this reader knows none",
                                   h.incompatible_features));
  }
  if (h.chunk_count < 1 || h.chunk_count > kMaxChunks ||
      kHeaderBytes + std::uint64_t{kIndexEntryBytes} * h.chunk_count > size) {
    return invalid("F5", 24,
                   fmt::format("chunk_count is {}, expected 1 to 2^20 with the index inside the {} bytes",
                               h.chunk_count, size));
  }
  if (h.align_log2 < kMinAlignLog2 || h.align_log2 > kMaxAlignLog2) {
    return invalid("F6", 28, fmt::format("align_log2 is {}, expected 4 to 16", h.align_log2));
  }
  if (h.file_bytes != size) {
    return invalid("F7", 32, fmt::format("file_bytes is {}, but the file has {} bytes", h.file_bytes, size));
  }
  if (load_u64(p + 48) != 0) return invalid("F8", 48, "the header's reserved field is not 0");
  return h;
}

// Rules D1 to D7 on one entry; previous is the entry before, or null.
std::optional<Error> entry_fault(const IndexEntry& e, const IndexEntry* previous, std::size_t number) {
  const std::uint64_t at = kHeaderBytes + kIndexEntryBytes * number;
  const auto say = [&](const char* rule, std::uint64_t field, const std::string& what) {
    return invalid(rule, at + field, fmt::format("chunk {} '{}' {}", number, type_name(e.key.type), what));
  };
  const bool payload = (e.key.flags & kPayload) != 0, critical = (e.key.flags & kCritical) != 0;
  if (e.key.flags > 7 || (payload && !critical)) {
    return say("D1", 4,
               fmt::format("has flags {:#x}, expected bits 0 to 2, payload only with critical", e.key.flags));
  }
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t c = e.key.type >> (8 * i) & 0xff;
    if (c < 0x21 || c > 0x7e) return say("D2", 0, "has a type that is not four printable characters");
  }
  if (e.codec != Codec::raw && e.codec != Codec::zstd) {
    return say("D3", 6, fmt::format("has codec {}, expected 0 or 1", static_cast<unsigned>(e.codec)));
  }
  if (e.raw_bytes < 1 || e.raw_bytes > kMaxChunkBytes) {
    return say("D4", 24, fmt::format("has raw_bytes {}, expected 1 to 2^27", e.raw_bytes));
  }
  if (e.codec == Codec::raw ? e.stored_bytes != e.raw_bytes
                            : e.stored_bytes < 1 || e.stored_bytes >= e.raw_bytes) {
    return say("D5", 16,
               fmt::format("has stored_bytes {} with raw_bytes {} and codec {}", e.stored_bytes, e.raw_bytes,
                           static_cast<unsigned>(e.codec)));
  }
  if (previous != nullptr && !(previous->key.order() < e.key.order())) {
    return say("D6", 0, "is out of canonical order");
  }
  if (e.key.item != 0) return say("D7", 40, fmt::format("has item {}, expected 0", e.key.item));
  return std::nullopt;
}

// Rules D8 to D10: offsets are prefix sums, and so is the file's size.
std::optional<Error> layout_fault(const Directory& d) {
  CheckedSize end = kHeaderBytes + std::uint64_t{kIndexEntryBytes} * d.entries.size();
  CheckedSize payload = 0;
  for (std::size_t i = 0; i < d.entries.size(); ++i) {
    const IndexEntry& e = d.entries[i];
    const CheckedSize offset = align_up(end, d.header.align_log2);
    if (!offset.valid() || e.offset != offset.value()) {
      return invalid("D8", kHeaderBytes + kIndexEntryBytes * i + 8,
                     fmt::format("chunk {} '{}' begins at {}, expected {}", i, type_name(e.key.type),
                                 e.offset, offset.saturated()));
    }
    end = offset + CheckedSize(e.stored_bytes);
    if (e.key.flags & kPayload) payload = payload + CheckedSize(e.raw_bytes);
  }
  if (!end.valid() || end.value() != d.header.file_bytes) {
    return invalid(
        "D9", 32,
        fmt::format("file_bytes is {}, but the chunks end at {}", d.header.file_bytes, end.saturated()));
  }
  if (!payload.valid() || payload.value() != d.header.payload_bytes) {
    return invalid("D10", 40,
                   fmt::format("payload_bytes is {}, but the chunks give {}", d.header.payload_bytes,
                               payload.saturated()));
  }
  return std::nullopt;
}

const IndexEntry* find_entry(const Directory& directory, const ChunkKey& key) {
  const auto found =
      std::lower_bound(directory.entries.begin(), directory.entries.end(), key,
                       [](const IndexEntry& e, const ChunkKey& k) { return e.key.order() < k.order(); });
  if (found == directory.entries.end() || found->key.order() != key.order()) return nullptr;
  return &*found;
}

// HEAD and PARM, which D12 demands in every file.
Result<Bytes> read_described(const ByteSource& source, const Directory& directory, const ChunkKey& key,
                             std::uint64_t most) {
  const IndexEntry* entry = find_entry(directory, key);
  if (entry == nullptr || entry->key.flags != key.flags) {
    return invalid("D12", 0,
                   fmt::format("there is no {} chunk with flags {}", type_name(key.type), key.flags));
  }
  if (entry->raw_bytes > most) {
    return invalid(
        "D12", 0,
        fmt::format("{} has {} bytes, expected at most {}", type_name(key.type), entry->raw_bytes, most));
  }
  return read_chunk(source, *entry);
}

// Chunks that every model's file may have, once each, and that no decoder needs.
constexpr ChunkKey kAncillary[] = {{kMeta, kSafeToCopy}, {kDomn, 0}, {kQual, 0}};

bool is_ancillary(const ChunkKey& key) {
  return std::any_of(std::begin(kAncillary), std::end(kAncillary), [&](const ChunkKey& known) {
    return key.flags == known.flags && key.order() == known.order();
  });
}

// What such a chunk says, by its own reader; nothing where the file has none. `rule` bounds its size, before
// anything of the size is allocated.
template <class T, class Read>
Result<std::optional<T>> read_ancillary(const ByteSource& source, const Directory& directory,
                                        const ChunkKey& key, std::uint64_t most, const char* rule,
                                        const Read& read) {
  const IndexEntry* entry = find_entry(directory, key);
  if (entry == nullptr) return std::optional<T>();
  if (entry->raw_bytes > most) {
    return invalid(
        rule, entry->offset,
        fmt::format("{} has {} bytes, expected at most {}", type_name(key.type), entry->raw_bytes, most));
  }
  const Result<Bytes> raw = read_chunk(source, *entry);
  if (!raw) return raw.error();
  Result<T> found = read(*raw);
  if (found) return std::optional<T>(*std::move(found));
  Error error = found.error();
  error.offset = entry->offset;  // of the chunk: stored bytes need not be the raw ones
  return error;
}

bool is_known_type(std::uint32_t type, const ModelFormat& model) {
  const auto named = [&](const ChunkKey& known) { return known.type == type; };
  return type == kHead || type == kParm || model.knows_type(type) ||
         std::any_of(std::begin(kAncillary), std::end(kAncillary), named);
}

std::string key_text(const ChunkKey& k) {
  return fmt::format("'{}' (level {}, part {}, tile {})", type_name(k.type), k.level, k.part, k.tile);
}

// Rules D11 and D12: the critical chunks are exactly those that HEAD and PARM demand.
std::optional<Error> demand_fault(const Directory& directory, const ModelFormat& model,
                                  std::vector<ChunkSpec> expected, std::uint64_t head_bytes) {
  expected.push_back({{kHead, kCritical}, head_bytes});
  std::sort(expected.begin(), expected.end(),
            [](const ChunkSpec& a, const ChunkSpec& b) { return a.key.order() < b.key.order(); });
  for (std::size_t i = 0; i < directory.entries.size(); ++i) {
    const IndexEntry& e = directory.entries[i];
    if ((e.key.flags & kCritical) && !is_known_type(e.key.type, model)) {
      return unsupported("D11", kHeaderBytes + kIndexEntryBytes * i,
                         fmt::format("chunk '{}' is critical and unknown to this reader for model {}",
                                     type_name(e.key.type), model.name));
    }
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < directory.entries.size(); ++i) {
    const IndexEntry& e = directory.entries[i];
    if (!is_known_type(e.key.type, model)) continue;
    const std::uint64_t at = kHeaderBytes + kIndexEntryBytes * i;
    if (is_ancillary(e.key)) continue;
    if (next == expected.size()) return invalid("D12", at, "there is a chunk too many: " + key_text(e.key));
    const ChunkSpec& want = expected[next++];
    if (e.key.order() != want.key.order() || e.key.flags != want.key.flags) {
      return invalid("D12", at,
                     fmt::format("chunk {} is {} with flags {}, expected {} with flags {}", i,
                                 key_text(e.key), e.key.flags, key_text(want.key), want.key.flags));
    }
    if (e.raw_bytes != want.raw_bytes) {
      return invalid("D12", at + 24,
                     fmt::format("chunk {} has raw_bytes {}, the parameters give {}", key_text(e.key),
                                 e.raw_bytes, want.raw_bytes));
    }
  }
  if (next != expected.size()) {
    return invalid("D12", 24,
                   "there is no chunk " + key_text(expected[next].key) + ", which the parameters demand");
  }
  return std::nullopt;
}

// Rule P1.
std::optional<Error> padding_fault(const ByteSource& source, const Directory& d) {
  std::uint64_t end = kHeaderBytes + std::uint64_t{kIndexEntryBytes} * d.entries.size();
  Bytes gap;
  for (const IndexEntry& e : d.entries) {
    gap.resize(e.offset - end);
    if (!gap.empty() && !source.read(source.user, end, gap.data(), gap.size()))
      return short_read(end, gap.size());
    for (std::size_t i = 0; i < gap.size(); ++i) {
      if (gap[i] != 0) return invalid("P1", end + i, fmt::format("the padding byte at {} is not 0", end + i));
    }
    end = e.offset + e.stored_bytes;
  }
  return std::nullopt;
}

}  // namespace

Result<Directory> read_directory(const ByteSource& source, const ReadLimits& limits) {
  if (source.size < kHeaderBytes) {
    return invalid("F1", 0, fmt::format("not a btfc file: {} bytes, expected at least 64", source.size));
  }
  std::array<std::uint8_t, kHeaderBytes> head{};
  if (!source.read(source.user, 0, head.data(), head.size())) return short_read(0, head.size());
  Result<Header> header = parse_header(head.data(), source.size);
  if (!header) return header.error();
  if (header->chunk_count > limits.max_chunks) {
    return Error{Status::limit,
                 fmt::format("{} chunks, the reader's limit is {}", header->chunk_count, limits.max_chunks),
                 "", 24};
  }

  // The hash covers the header without itself, then the index: one buffer holds both.
  const std::size_t index_bytes = std::size_t{kIndexEntryBytes} * header->chunk_count;
  Bytes hashed(56 + index_bytes);
  std::copy_n(head.begin(), 56, hashed.begin());
  std::uint8_t* const index = hashed.data() + 56;
  if (!source.read(source.user, kHeaderBytes, index, index_bytes))
    return short_read(kHeaderBytes, index_bytes);
  if (content_hash(hashed) != load_u64(&head[56])) {
    return invalid("F9", 56, "directory_hash does not match: the header or the index is damaged");
  }

  Directory d;
  d.header = *header;
  d.entries.reserve(header->chunk_count);
  for (std::size_t i = 0; i < header->chunk_count; ++i) {
    d.entries.push_back(parse_entry(index + kIndexEntryBytes * i));
    if (auto fault = entry_fault(d.entries[i], i == 0 ? nullptr : &d.entries[i - 1], i)) return *fault;
  }
  if (auto fault = layout_fault(d)) return *fault;
  if (d.header.payload_bytes > limits.max_payload_bytes) {
    return Error{Status::limit,
                 fmt::format("payload of {} bytes, the reader's limit is {}", d.header.payload_bytes,
                             limits.max_payload_bytes),
                 "", 40};
  }
  return d;
}

Result<Bytes> read_chunk(const ByteSource& source, const IndexEntry& entry) {
  Bytes stored(entry.stored_bytes);
  if (!source.read(source.user, entry.offset, stored.data(), stored.size())) {
    return short_read(entry.offset, stored.size());
  }
  const auto placed = [&](Error error) {
    error.message =
        fmt::format("chunk '{}' at {}: {}", type_name(entry.key.type), entry.offset, error.message);
    error.offset = entry.offset;
    return error;
  };
  Result<Bytes> raw = entry.codec == Codec::raw ? Result<Bytes>(std::move(stored))
                                                : decode_chunk(stored, entry.codec, entry.raw_bytes);
  if (!raw) return placed(raw.error());
  if (content_hash(*raw) != entry.raw_hash)
    return placed(invalid("C3", 0, "raw_hash does not match its bytes"));
  return raw;
}

Result<OpenedFile> open_file(const ByteSource& source, const ReadLimits& limits) {
  Result<Directory> directory = read_directory(source, limits);
  if (!directory) return directory.error();
  const Result<Bytes> head_raw =
      read_described(source, *directory, {kHead, kCritical}, 32 + 32 * std::uint64_t{kMaxMaps});
  if (!head_raw) return head_raw.error();
  Result<Head> head = read_head(*head_raw);
  if (!head) return head.error();
  Result<Bytes> parm = read_described(source, *directory, {kParm, kCritical | kPayload}, kMaxParmBytes);
  if (!parm) return parm.error();

  const ModelFormat& model = *find_model(head->model);
  Result<Layout> layout = model.layout(*head, *parm);
  if (!layout) return layout.error();
  if (auto fault = demand_fault(*directory, model, layout->chunks, head_raw->size())) return *fault;
  return OpenedFile{*std::move(directory), *std::move(head), *std::move(parm), *std::move(layout)};
}

ChunkReader chunk_reader(const ByteSource& source, const OpenedFile& file) {
  return [&](const ChunkKey& key) -> Result<Bytes> {
    const IndexEntry* entry = find_entry(file.directory, key);
    if (entry == nullptr) return invalid("D12", 0, "there is no chunk " + key_text(key));
    return read_chunk(source, *entry);
  };
}

Result<LoadedItem> load_item(const ByteSource& source, const OpenedFile& file, std::uint32_t levels) {
  return find_model(file.head.model)->load(file.head, file.parm, chunk_reader(source, file), levels);
}

Result<std::optional<Domain>> read_file_domain(const ByteSource& source, const OpenedFile& file) {
  return read_ancillary<Domain>(source, file.directory, {kDomn, 0}, kMaxDomainBytes, "DM1",
                                [&](ByteView raw) { return read_domain(file.head, raw); });
}

Result<Meta> read_file_meta(const ByteSource& source, const Directory& directory) {
  const auto meta =
      read_ancillary<Meta>(source, directory, {kMeta, kSafeToCopy}, kMaxMetaBytes, "M1", read_meta);
  if (!meta) return meta.error();
  return meta->value_or(Meta{});
}

Result<std::optional<QualityCurve>> read_file_quality(const ByteSource& source, const OpenedFile& file) {
  return read_ancillary<QualityCurve>(source, file.directory, {kQual, 0}, kMostQualityBytes, "QU1",
                                      [&](ByteView raw) { return read_quality(raw, file.head.pairs); });
}

Result<Done> verify_file(const ByteSource& source, const ReadLimits& limits) {
  const Result<OpenedFile> file = open_file(source, limits);
  if (!file) return file.error();
  for (const IndexEntry& entry : file->directory.entries) {
    if (const Result<Bytes> raw = read_chunk(source, entry); !raw) return raw.error();
  }
  if (const Result<LoadedItem> item = load_item(source, *file); !item) return item.error();
  if (const auto domain = read_file_domain(source, *file); !domain) return domain.error();
  if (const Result<Meta> meta = read_file_meta(source, file->directory); !meta) return meta.error();
  if (const auto quality = read_file_quality(source, *file); !quality) return quality.error();
  if (auto fault = padding_fault(source, file->directory)) return *fault;
  // D12 makes this hold; stated again because the promise to users is about these two numbers.
  if (file->layout.formula_bits != 8 * file->directory.header.payload_bytes) {
    return invalid("D12", 40,
                   fmt::format("the payload has {} bits, the formula gives {}",
                               8 * file->directory.header.payload_bytes, file->layout.formula_bits));
  }
  return Done{};
}

Result<std::vector<RawChunk>> read_all_chunks(const ByteSource& source, const Directory& directory) {
  std::vector<RawChunk> chunks;
  chunks.reserve(directory.entries.size());
  for (const IndexEntry& entry : directory.entries) {
    Result<Bytes> raw = read_chunk(source, entry);
    if (!raw) return raw.error();
    chunks.push_back({entry.key, *std::move(raw)});
  }
  return chunks;
}

}  // namespace btfc
