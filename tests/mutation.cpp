// Mutations: bytes, fields and pieces of files, and whole recipes with other parameters.
#include "tests/mutation.h"

#include <algorithm>

#include "tests/damaged_file.h"

namespace btfc::test {
namespace {

constexpr std::uint64_t kBoundaries[] = {0,          1,           2,           3,          4,
                                         0x7f,       0x80,        0xff,        0x100,      0x7fff,
                                         0x8000,     0xffff,      0x10000,     0x10001,    0x7fffffff,
                                         0x80000000, 0xffffffff,  0x100000000, 1ull << 47, 1ull << 63,
                                         ~0ull,      ~0ull - 15u, ~0ull >> 1,  1ull << 27, (1ull << 27) + 1};
// Reshaped files stay small: there should be many of them.
constexpr std::uint64_t kMostReshapedBytes = 32768;

std::uint64_t boundary(Random& random) { return kBoundaries[random.below(std::size(kBoundaries))]; }

// Half of the edits hit the header and the index, which are a small part of a file and hold most of its
// rules. With repaired hashes more of them get past the header.
std::size_t position(Random& random, const Bytes& file, Damage damage) {
  const std::size_t size = file.size();
  if (random.one_in(2)) return random.below(size);
  if (random.one_in(damage == Damage::repaired ? 8 : 2))
    return random.below(std::min<std::size_t>(size, kHeaderBytes));
  const std::uint64_t index = size < kHeaderBytes ? 0 : std::uint64_t{load_u32(&file[24])} * kIndexEntryBytes;
  const std::uint64_t end = std::min<std::uint64_t>(size, kHeaderBytes + index);
  return end <= kHeaderBytes ? random.below(size) : kHeaderBytes + random.below(end - kHeaderBytes);
}

// One edit that keeps the size.
void edit(Random& random, const std::vector<Seed>& seeds, Bytes& file, std::size_t at) {
  static constexpr std::uint8_t kValues[] = {0, 1, 0x7f, 0x80, 0xff};
  const auto room = [&](std::size_t size) { return file.size() >= size; };
  const auto aligned = [&](std::size_t size) { return std::min(at / size * size, file.size() - size); };
  switch (random.below(8)) {
    case 0:
    case 1:
      file[at] = static_cast<std::uint8_t>(random.next());
      return;
    case 2:
    case 3:
      file[at] = static_cast<std::uint8_t>(file[at] ^ 1u << random.below(8));
      return;
    case 4:
      file[at] = kValues[random.below(std::size(kValues))];
      return;
    case 5:
      if (room(4)) store_u32(&file[aligned(4)], static_cast<std::uint32_t>(boundary(random)));
      return;
    case 6:
      if (room(8)) store_u64(&file[aligned(8)], boundary(random));
      return;
    default: {
      const Bytes& other = seeds[random.below(seeds.size())].file;
      const std::size_t from = random.one_in(2) ? std::min(at, other.size()) : random.below(other.size());
      const std::size_t size = std::min({1 + random.below(64), other.size() - from, file.size() - at});
      std::copy_n(other.begin() + static_cast<std::ptrdiff_t>(from), size,
                  file.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }
}

void resize_file(Random& random, Bytes& file) {
  const std::size_t size = random.one_in(2) ? random.below(file.size())
                                            : file.size() + 1 + random.below(random.one_in(2) ? 16 : 600);
  file.resize(size, random.one_in(2) ? std::uint8_t{0} : static_cast<std::uint8_t>(random.next()));
  // Half of them with a header that admits it.
  if (random.one_in(2) && file.size() >= kHeaderBytes) store_u64(&file[32], file.size());
}

// A field of HEAD or PARM: small steps keep rules that random values would break.
void edit_field(Random& random, Bytes& raw) {
  if (raw.size() < 4) return;
  const std::size_t at = 4 * random.below(raw.size() / 4);
  const std::uint32_t value = load_u32(&raw[at]);
  switch (random.below(6)) {
    case 0:
      raw[at + random.below(4)] ^= static_cast<std::uint8_t>(1u << random.below(8));
      return;
    case 1:
      store_u32(&raw[at], static_cast<std::uint32_t>(boundary(random)));
      return;
    case 2:
      store_u32(&raw[at], 2 * value);
      return;
    default:
      store_u32(&raw[at], value + static_cast<std::uint32_t>(random.below(9)) - 4);
  }
}

// Bytes for a chunk whose size has changed: its old ones, repeated, or zeros, or noise.
Bytes refill(Random& random, const std::vector<RawChunk>& chunks, const ChunkSpec& spec) {
  const auto old = std::find_if(chunks.begin(), chunks.end(),
                                [&](const RawChunk& c) { return c.key.order() == spec.key.order(); });
  if (old != chunks.end() && old->raw.size() == spec.raw_bytes) return old->raw;
  Bytes raw(spec.raw_bytes);
  const std::uint64_t kind = random.below(3);
  for (std::size_t i = 0; i < raw.size() && kind != 0; ++i) {
    raw[i] = kind == 1 || old == chunks.end() || old->raw.empty() ? static_cast<std::uint8_t>(random.next())
                                                                  : old->raw[i % old->raw.size()];
  }
  return raw;
}

const Bytes* find_raw(const std::vector<RawChunk>& chunks, std::uint32_t type) {
  for (const RawChunk& chunk : chunks) {
    if (chunk.key.type == type) return &chunk.raw;
  }
  return nullptr;
}

}  // namespace

std::uint64_t Random::next() {
  state_ += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state_;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

Bytes reshape(Random& random, const std::vector<RawChunk>& old) {
  const Bytes *old_head = find_raw(old, kHead), *old_parm = find_raw(old, kParm);
  if (old_head == nullptr || old_parm == nullptr) return {};
  for (int attempt = 0; attempt < 6; ++attempt) {
    Bytes head_raw = *old_head, parm = *old_parm;
    for (std::uint64_t n = random.below(4); n > 0; --n)
      edit_field(random, random.one_in(3) ? head_raw : parm);
    const Result<Head> head = read_head(head_raw);
    if (!head) continue;
    const ModelFormat* model = find_model(head->model);
    if (model == nullptr) continue;
    const Result<Layout> layout = model->layout(*head, parm);
    if (!layout) continue;
    std::uint64_t size = 0;
    for (const ChunkSpec& spec : layout->chunks) size += spec.raw_bytes;
    if (size > kMostReshapedBytes) continue;

    std::vector<RawChunk> chunks;
    for (const RawChunk& chunk : old) {
      if ((chunk.key.flags & kCritical) == 0 || chunk.key.type == kHead)
        chunks.push_back({chunk.key, chunk.key.type == kHead ? head_raw : chunk.raw});
    }
    for (const ChunkSpec& spec : layout->chunks)
      chunks.push_back({spec.key, spec.key.type == kParm ? parm : refill(random, old, spec)});
    for (std::uint64_t n = random.below(4); n > 0; --n) {
      RawChunk& chunk = chunks[random.below(chunks.size())];
      if (chunk.key.type != kHead && chunk.key.type != kParm && !chunk.raw.empty())
        chunk.raw[random.below(chunk.raw.size())] = static_cast<std::uint8_t>(random.next());
    }
    PackOptions options;
    options.codec = random.one_in(16) ? Codec::zstd : Codec::raw;
    options.zstd_level = 1;
    Result<Bytes> file = pack_file(std::move(chunks), options);
    if (file) return *std::move(file);
  }
  return {};
}

Result<Seed> make_seed(std::string name, Bytes file) {
  const Result<Done> verified = verify_bytes(file);
  if (!verified) return verified.error();
  const ByteView view(file);
  const Result<Directory> directory = read_directory(source_of(view));
  if (!directory) return directory.error();
  Result<std::vector<RawChunk>> chunks = read_all_chunks(source_of(view), *directory);
  if (!chunks) return chunks.error();
  return Seed{std::move(name), std::move(file), *std::move(chunks)};
}

Mutant mutate(const std::vector<Seed>& seeds, std::uint64_t run, std::uint64_t number) {
  Random random(Random(run).next() ^ Random(~number).next());
  Mutant mutant;
  mutant.seed = random.below(seeds.size());
  // Half of all without repair, a quarter of each of the others.
  const std::uint64_t kind = random.below(4);
  if (kind == 3) {
    mutant.damage = Damage::reshaped;
    mutant.file = reshape(random, seeds[mutant.seed].chunks);
    if (!mutant.file.empty()) return mutant;
  }
  mutant.damage = kind < 2 ? Damage::bytes : Damage::repaired;
  mutant.file = seeds[mutant.seed].file;
  for (std::uint64_t n = 1 + random.below(8); n > 0; --n)
    edit(random, seeds, mutant.file, position(random, mutant.file, mutant.damage));
  if (random.one_in(16)) resize_file(random, mutant.file);
  if (mutant.damage == Damage::repaired) repair_hashes(mutant.file);
  return mutant;
}

}  // namespace btfc::test
