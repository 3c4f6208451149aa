// Magic, identity, hash of the state, state.
#include "encoder/models/gm_checkpoint.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>

#include "encoder/output/atomic_file.h"
#include "format/chunk_codec.h"

namespace btfc {
namespace {

constexpr char kMagic[8] = {'b', 't', 'f', 'c', 'f', 'i', 't', '1'};
constexpr std::size_t kHeadBytes = 24;

}  // namespace

Result<Done> write_checkpoint(const std::string& path, std::uint64_t identity, const Bytes& state) {
  Bytes file(kHeadBytes);
  std::memcpy(file.data(), kMagic, sizeof kMagic);
  store_u64(&file[8], identity);
  store_u64(&file[16], content_hash(state));
  file.insert(file.end(), state.begin(), state.end());
  return write_file(path, file);
}

Result<Bytes> begin_checkpoint(const std::string& path, std::uint64_t identity) {
  if (const auto writable = PendingFile::create(path); !writable) return writable.error();
  if (!std::filesystem::exists(path)) return Bytes{};
  Result<Bytes> file = read_file(path);
  if (!file) return file.error();
  const auto refused = [&](const char* what) { return bad_data(fmt::format("'{}': {}", path, what)); };
  if (file->size() < kHeadBytes || std::memcmp(file->data(), kMagic, sizeof kMagic) != 0)
    return refused("expected the state of a fit, as --checkpoint writes it");
  const ByteView state = ByteView(*file).subspan(kHeadBytes);
  if (content_hash(state) != load_u64(&(*file)[16])) return refused("the state of a fit, but damaged");
  if (load_u64(&(*file)[8]) != identity)
    return refused("the state of another fit: other data, options or seed");
  return Bytes(state.begin(), state.end());
}

}  // namespace btfc
