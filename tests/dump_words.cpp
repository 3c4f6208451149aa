// What a shader is given, through the C interface, for the count of its operations (cost_test.py).
// btfc_dump_words IN.btfc OUT.u32 [--window X,Y,W,H]: 32-bit words of the machine: the number of maps; of
// each map the number of its params and these; of each of the four slots the number of its words and these.
// With a window of a random field they are those of a prepared texture: params that speak of the window, the
// atlas in slot 2. Printed is what `btfc size` would of its parameters, by the same code; the command takes
// long to start.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "decoder/field_plan.h"
#include "decoder/handles.h"
#include "encoder/output/atomic_file.h"
#include "tools/file_source.h"
#include "tools/size_report.h"
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

bool print_size(const char* path) {
  const Result<FileSource> file = FileSource::open(path);
  if (!file) return false;
  const Result<OpenedFile> opened = open_file(file->source());
  if (!opened) return false;
  std::puts(size_json(opened->head, opened->layout).dump().c_str());
  return true;
}

// What the GPU's passes would make of the window, made here.
Result<Done> prepare(btfc_texture& texture, const GpuWindow& window) {
  if (texture.model->prepare == nullptr) return bad_argument("this model prepares nothing");
  Result<GpuPrepare> plan = texture.model->prepare(texture.item, window);
  if (!plan) return plan.error();
  texture.item.map_params = std::move(plan->map_params);
  texture.item.words[2] = field_atlas(texture.item, params_of<FieldParams>(texture.item, 0));
  return Done{};
}

}  // namespace

int main(int argc, char** argv) {
  GpuWindow window{};
  const bool wanted = argc == 5 && std::strcmp(argv[3], "--window") == 0;
  if ((argc != 3 && !wanted) ||
      (wanted && std::sscanf(argv[4], "%" SCNd32 ",%" SCNd32 ",%" SCNu32 ",%" SCNu32, &window.x, &window.y,
                             &window.width, &window.height) != 4)) {
    std::fprintf(stderr, "usage: btfc_dump_words IN.btfc OUT.u32 [--window X,Y,W,H]\n");
    return 1;
  }
  const Result<TexturePtr> texture = load_texture(argv[1]);
  if (!texture) {
    std::fprintf(stderr, "btfc_dump_words: %s\n", texture.error().message.c_str());
    return 3;
  }
  if (const auto made = wanted ? prepare(**texture, window) : Result<Done>(Done{}); !made) {
    std::fprintf(stderr, "btfc_dump_words: %s\n", made.error().message.c_str());
    return 4;
  }
  Words words;
  if (!all_words(texture->get(), words) || !print_size(argv[1])) return 4;
  Bytes raw(words.size() * sizeof(std::uint32_t));
  std::memcpy(raw.data(), words.data(), raw.size());
  return write_file(argv[2], raw) ? 0 : 2;
}
