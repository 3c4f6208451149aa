// libFuzzer's mutations of whole files: most keep hashes, offsets and sizes right, so that they reach the
// rules and the evaluation behind them.
#include <algorithm>
#include <cstring>

#include "tests/damaged_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/mutation.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using namespace btfc;
using test::Random;

// Files that claim more are left to the plain mutations.
constexpr std::uint64_t kMostUndoneBytes = 1u << 20;

std::vector<RawChunk> chunks_of(ByteView file) {
  const Result<Directory> directory = read_directory(memory_source(&file));
  if (!directory) return {};
  std::uint64_t raw = 0;
  for (const IndexEntry& entry : directory->entries) raw += entry.raw_bytes;
  if (raw > kMostUndoneBytes) return {};
  Result<std::vector<RawChunk>> chunks = read_all_chunks(memory_source(&file), *directory);
  return chunks ? *std::move(chunks) : std::vector<RawChunk>();
}

void mutate_bytes(Bytes& bytes, std::size_t room, bool keep_size) {
  const std::size_t size = bytes.size();
  bytes.resize(size + room);
  bytes.resize(LLVMFuzzerMutate(bytes.data(), size, bytes.size()));
  if (keep_size || bytes.empty()) bytes.resize(std::max<std::size_t>(size, 1));
}

// One chunk's bytes changed, everything about it made right; now and then a chunk more or less.
Bytes repacked(Random& random, std::vector<RawChunk> chunks) {
  const std::size_t at = random.below(chunks.size());
  if (random.one_in(16)) {
    chunks.erase(chunks.begin() + static_cast<std::ptrdiff_t>(at));
    if (chunks.empty()) return {};
  } else if (random.one_in(16)) {
    const bool meta = random.one_in(2);
    RawChunk more{{meta ? kMeta : four_cc("XtrA"), kSafeToCopy}, write_meta({{"a", "1"}, {"b", ""}})};
    mutate_bytes(more.raw, 16, meta);
    chunks.push_back(std::move(more));
  } else {
    mutate_bytes(chunks[at].raw, 16, !random.one_in(4));
  }
  PackOptions options;
  options.codec = random.one_in(4) ? Codec::zstd : Codec::raw;
  options.zstd_level = 1;
  options.align_log2 = random.one_in(16) ? 4 + static_cast<std::uint32_t>(random.below(4)) : kMinAlignLog2;
  Result<Bytes> file = pack_file(std::move(chunks), options);
  return file ? *std::move(file) : Bytes();
}

Bytes changed(Random& random, const Bytes& file) {
  if (!random.one_in(5)) {
    std::vector<RawChunk> chunks = chunks_of(file);
    if (!chunks.empty()) {
      Bytes made = random.one_in(3) ? test::reshape(random, chunks) : repacked(random, std::move(chunks));
      if (!made.empty()) return made;
    }
  }
  Bytes made = file;
  const bool whole = made.empty() || random.one_in(2);
  if (whole) {
    mutate_bytes(made, 64, random.one_in(2));
  } else {
    // Of the header and the index alone, which a file is mostly not.
    const std::size_t front =
        std::min<std::size_t>(made.size(), kHeaderBytes + kIndexEntryBytes * (1 + random.below(8)));
    Bytes part(made.begin(), made.begin() + static_cast<std::ptrdiff_t>(front));
    mutate_bytes(part, 0, true);
    std::copy_n(part.begin(), front, made.begin());
  }
  if (!random.one_in(4)) {
    if (made.size() >= kHeaderBytes && random.one_in(2)) store_u64(&made[32], made.size());
    test::repair_hashes(made);
  }
  return made;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Random random(seed);
  const fuzz::FileInput input = fuzz::file_input(data, size);
  Bytes file(input.file().begin(), input.file().end()), choices(input.choices.begin(), input.choices.end());
  choices.resize(fuzz::kChoiceBytes);
  const bool of_choices = random.one_in(3);
  if (of_choices) mutate_bytes(choices, 0, true);
  if (!of_choices || random.one_in(4)) {
    Bytes made = changed(random, file);
    if (made.size() + choices.size() <= max_size) file = std::move(made);
  }
  if (file.size() + choices.size() > max_size) return size;
  std::copy(file.begin(), file.end(), data);
  std::copy(choices.begin(), choices.end(), data + file.size());
  return file.size() + choices.size();
}
