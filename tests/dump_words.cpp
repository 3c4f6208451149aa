// What a shader is given, through the C interface, for the count of its operations (cost_test.py).
// btfc_dump_words IN.btfc OUT.u32: 32-bit words of the machine: the number of maps; of each map the number of
// its params and these; of each of the four slots the number of its words and these.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "encoder/output/atomic_file.h"
#include "tools/texture_file.h"

namespace {

using namespace btfc;

using Words = std::vector<std::uint32_t>;

// Appends a count of words and room for them, which `write` fills.
template <class Write>
bool append(Words& out, std::size_t size, const Write& write) {
  Words words(size / sizeof(std::uint32_t));
  if (size != 0 && write(words.data(), size) != BTFC_OK) return false;
  out.push_back(static_cast<std::uint32_t>(words.size()));
  out.insert(out.end(), words.begin(), words.end());
  return true;
}

bool all_words(const btfc_texture* texture, Words& out) {
  const std::uint32_t maps = btfc_texture_maps(texture);
  out.push_back(maps);
  for (std::uint32_t map = 0; map < maps; ++map) {
    if (!append(out, btfc_gpu_params_size(texture, map), [&](void* words, std::size_t size) {
          return btfc_gpu_write_params(texture, map, words, size);
        })) {
      return false;
    }
  }
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot) {
    if (!append(out, btfc_gpu_words_size(texture, slot), [&](void* words, std::size_t size) {
          return btfc_gpu_write_words(texture, slot, words, size);
        })) {
      return false;
    }
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: btfc_dump_words IN.btfc OUT.u32\n");
    return 1;
  }
  const Result<TexturePtr> texture = load_texture(argv[1]);
  if (!texture) {
    std::fprintf(stderr, "btfc_dump_words: %s\n", texture.error().message.c_str());
    return 3;
  }
  Words words;
  if (!all_words(texture->get(), words)) return 4;
  Bytes raw(words.size() * sizeof(std::uint32_t));
  std::memcpy(raw.data(), words.data(), raw.size());
  return write_file(argv[2], raw) ? 0 : 2;
}
