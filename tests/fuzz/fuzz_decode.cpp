// Fuzz target: a file loaded at a level, with a period and a relief or with fewer gates, and decoded in every
// way: no value that is not finite, none left unwritten, and the same twice.
#include <cmath>
#include <vector>

#include "tests/fuzz/fuzz_reader.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

std::size_t sample_bytes(btfc_sample sample) {
  return sample == BTFC_FLOAT32 ? 4 : sample == BTFC_UNORM8 ? 1 : 2;
}

void read_direction(Choices& choices, float (&direction)[3]) {
  const std::uint8_t kind = choices.u8();
  for (float& v : direction) {
    if (kind < 128) {
      v = static_cast<float>(static_cast<std::int8_t>(choices.u8())) / 64.0f;
    } else if (kind < 160) {
      v = choices.f32();  // anything at all
    } else {
      v = 0;
    }
  }
}

btfc_directions read_directions(Choices& choices) {
  btfc_directions d{};
  read_direction(choices, d.view);
  read_direction(choices, d.light);
  d.footprint = choices.u8() < 16 ? choices.f32() : static_cast<float>(choices.u8()) / 4;
  d.level = choices.u8() % 12u;
  return d;
}

std::int32_t coordinate(Choices& choices, std::uint32_t size) {
  const std::uint8_t kind = choices.u8();
  if (kind < 160) return static_cast<std::int32_t>(choices.u16() % size);
  return static_cast<std::int32_t>(choices.u32());
}

struct Query {
  std::uint32_t map;
  std::int32_t x, y;
  btfc_directions directions;
};

// Values of one texel, alone and as a sample.
void one_texel(const btfc_texture* t, btfc_scratch* scratch, const Query& q, btfc_sample sample) {
  btfc_map_info info{};
  FUZZ_CHECK(btfc_texture_map_info(t, q.map, &info) == BTFC_OK);
  btfc_query query{};
  query.map = q.map;
  query.x = q.x;
  query.y = q.y;
  query.level = q.directions.level;
  query.footprint = q.directions.footprint;
  std::memcpy(query.view, q.directions.view, sizeof query.view);
  std::memcpy(query.light, q.directions.light, sizeof query.light);
  std::vector<float> values(info.channels, NAN);
  FUZZ_CHECK(btfc_eval(t, scratch, &query, sizeof query, 1, values.data(), info.channels) == BTFC_OK);
  for (const float v : values) FUZZ_CHECK(std::isfinite(v));
  std::vector<std::uint8_t> code(info.channels * sample_bytes(sample));
  const std::int32_t texel[2] = {q.x, q.y};
  FUZZ_CHECK(btfc_decode_texels(t, scratch, q.map, &q.directions, texel, 1, sample, code.data(),
                                code.size()) == BTFC_OK);
}

// Many queries, which are sorted before they are answered.
void many_queries(const btfc_texture* t, btfc_scratch* scratch, Query q, Choices& choices) {
  std::vector<btfc_query> queries(300);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    queries[i].map = static_cast<std::uint32_t>(i) % btfc_texture_maps(t);
    queries[i].x = q.x + static_cast<std::int32_t>(i % 16) * ((q.x < 1 << 20) - (q.x >= 1 << 20));
    queries[i].y = q.y;
    std::memcpy(queries[i].view, q.directions.view, sizeof queries[i].view);
    std::memcpy(queries[i].light, q.directions.light, sizeof queries[i].light);
    queries[i].light[0] += static_cast<float>(i % 5);
    queries[i].footprint = i % 3 == 0 ? q.directions.footprint : 0;
    queries[i].level = choices.u8() % 4u;
  }
  std::vector<float> values(queries.size() * 4, 0);
  FUZZ_CHECK(btfc_eval(t, scratch, queries.data(), sizeof queries[0], queries.size(), values.data(), 4) ==
             BTFC_OK);
  for (const float v : values) FUZZ_CHECK(std::isfinite(v));
  std::vector<std::int32_t> texels;
  for (const btfc_query& query : queries) texels.insert(texels.end(), {query.x, query.y});
  FUZZ_CHECK(btfc_decode_texels(t, scratch, q.map, &q.directions, texels.data(), queries.size(), BTFC_FLOAT32,
                                values.data(), values.size() * 4) == BTFC_OK);
}

// A rectangle over two fills: a sample that is not written shows as a difference.
void rectangle(const btfc_texture* t, btfc_scratch* scratch, const Query& q, std::uint32_t width,
               std::uint32_t height, btfc_sample sample) {
  btfc_map_info info{};
  btfc_texture_map_info(t, q.map, &info);
  if (std::int64_t{q.x} + width > INT32_MAX || std::int64_t{q.y} + height > INT32_MAX) return;
  const std::size_t row = width * info.channels * sample_bytes(sample);
  std::vector<std::uint8_t> one(row * height, 0xaa), two(row * height, 0x55);
  for (std::vector<std::uint8_t>* out : {&one, &two}) {
    FUZZ_CHECK(btfc_decode_rect(t, scratch, q.map, &q.directions, q.x, q.y, width, height, sample,
                                out->data(), row, out->size()) == BTFC_OK);
  }
  FUZZ_CHECK(one == two);
  for (std::size_t i = 0; sample == BTFC_FLOAT32 && i < one.size(); i += 4) {
    float value;
    std::memcpy(&value, &one[i], 4);
    FUZZ_CHECK(std::isfinite(value));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const FileInput input = file_input(data, size);
  Choices choices(input.choices);
  const btfc_options options = bounded_options();
  btfc_error error{};
  btfc_reader* opened = nullptr;
  check_error(btfc_reader_open_memory(input.data.get(), input.size, &options, &opened, &error), error);
  const ReaderPtr reader(opened);
  if (reader == nullptr || !small_enough(opened)) return 0;
  btfc_file_info info{};
  btfc_reader_info(opened, &info);

  btfc_selection selection{};
  selection.struct_size = sizeof selection;
  selection.levels = choices.u8() % 8u;
  const std::uint8_t unbounded = choices.u8();
  if (info.unbounded != 0 && unbounded < 64) selection.period = 1u << (4 + unbounded % 6);
  if (info.unbounded != 0 && unbounded % 4 == 1) selection.relief = choices.u8() % 8u;
  if (info.gates != 0 && unbounded % 4 == 2) selection.gates = 1 + choices.below(info.gates);
  if (info.culls != 0 && unbounded % 8 == 3) selection.culling = 0.01f;
  btfc_texture* loaded = nullptr;
  const btfc_result result = btfc_texture_load(opened, &selection, &loaded, &error);
  const TexturePtr texture(loaded);
  check_error(result, error);
  FUZZ_CHECK((result == BTFC_OK) == (loaded != nullptr));
  if (loaded == nullptr) return 0;

  const bool scratched = choices.u8() % 4 == 0;
  const std::unique_ptr<btfc_scratch, void (*)(btfc_scratch*)> scratch(
      scratched ? btfc_scratch_new(loaded) : nullptr, btfc_scratch_free);
  Query q;
  q.map = choices.below(info.maps);
  q.x = coordinate(choices, info.width);
  q.y = coordinate(choices, info.height);
  q.directions = read_directions(choices);
  const auto sample = static_cast<btfc_sample>(choices.u8() % 4);
  const std::uint8_t what = choices.u8();
  // Tiles of 256 x 256 texels stand behind rectangles of unbounded textures, and behind scratches: every
  // eighth.
  const bool tiles = info.unbounded == 0 || what % 8 == 0;
  if (!scratched || tiles) one_texel(loaded, scratch.get(), q, sample);
  if (tiles && what % 2 == 0) many_queries(loaded, scratch.get(), q, choices);
  if (tiles && what % 4 != 1)
    rectangle(loaded, scratch.get(), q, 1 + choices.u8() % 24u, 1 + choices.u8() % 8u, sample);
  // A whole image, which has a way of its own.
  if (info.unbounded == 0 && what % 4 == 1 && std::uint64_t{info.width} * info.height <= 1024) {
    q.x = q.y = 0;
    rectangle(loaded, scratch.get(), q, info.width, info.height, sample);
  }
  return 0;
}
