// Fuzz target: HEAD, PARM and the contents of chunks of every model, without a container around them. The
// input is the sizes of HEAD and PARM, 2 bytes each, how many levels are loaded, these two, and then what
// chunks are filled with.
#include <algorithm>

#include "format/container.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

constexpr std::uint64_t kMostLoadedBytes = 1u << 20, kMostLoadedBits = 256u << 20;

// What follows from HEAD and PARM: the formula is the payload's size, and maps take no more than all.
bool check_layout(const Layout& layout) {
  std::uint64_t payload = 0, all = 0, maps = 0;
  for (const ChunkSpec& spec : layout.chunks) {
    FUZZ_CHECK((spec.key.flags & kCritical) != 0);
    all += spec.raw_bytes;
    if (spec.key.flags & kPayload) payload += spec.raw_bytes;
  }
  FUZZ_CHECK(layout.formula_bits == 8 * payload);
  for (const std::uint64_t bits : layout.map_bits) maps += bits;
  FUZZ_CHECK(maps <= layout.formula_bits);
  return all <= kMostLoadedBytes && layout.memory_bits <= kMostLoadedBits;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const std::size_t head_size = choices.u16(), parm_size = choices.u16();
  const std::uint32_t levels = choices.u8() < 128 ? kAllLevels : choices.u8() % 8u;
  const ByteView head_raw = choices.take(head_size), parm = choices.take(parm_size);
  ByteView contents = choices.take(choices.left());

  const Result<Head> head = read_head(head_raw);
  if (!head) return 0;
  const Bytes again = write_head(*head);
  FUZZ_CHECK(std::equal(again.begin(), again.end(), head_raw.begin(), head_raw.end()));
  const ModelFormat* model = find_model(head->model);
  FUZZ_CHECK(model != nullptr && model == find_model(model->name));
  const Result<Layout> layout = model->layout(*head, parm);
  if (!layout || !check_layout(*layout)) return 0;

  // Chunks in canonical order, one after another, zeros where the input ends.
  std::vector<ChunkSpec> specs = layout->chunks;
  std::sort(specs.begin(), specs.end(),
            [](const ChunkSpec& a, const ChunkSpec& b) { return a.key.order() < b.key.order(); });
  std::vector<std::pair<ChunkKey, Bytes>> chunks;
  for (const ChunkSpec& spec : specs) {
    if (spec.key.type == kParm) continue;
    const ByteView some = contents.first(std::min<std::size_t>(contents.size(), spec.raw_bytes));
    contents = contents.subspan(some.size());
    chunks.emplace_back(spec.key, Bytes(some.begin(), some.end())).second.resize(spec.raw_bytes);
  }
  const ChunkReader reader = [&](const ChunkKey& key) -> Result<Bytes> {
    for (const auto& [have, raw] : chunks) {
      if (have.order() == key.order()) return raw;
    }
    FUZZ_CHECK(false && "a chunk was asked for that the layout does not have");
    return Bytes();
  };
  const Result<LoadedItem> item = model->load(*head, parm, reader, levels);
  if (!item) {
    FUZZ_CHECK(item.error().status != Status::bad_argument && !item.error().message.empty());
    return 0;
  }
  std::uint64_t words = 0;
  for (const std::vector<std::uint32_t>& slot : item->words) words += slot.size();
  FUZZ_CHECK(levels != kAllLevels || 32 * words == layout->memory_bits);
  FUZZ_CHECK(item->map_params.size() == head->maps.size());
  return 0;
}
