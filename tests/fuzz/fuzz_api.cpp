// Fuzz target: any calls of the C interface in any order on one file: readers, textures, scratches and plans
// made and freed, arguments good and bad. The choices behind the file are the program: an opcode and its
// numbers.
#include <cmath>
#include <vector>

#include "tests/fuzz/fuzz_reader.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

// Builds with assertions stop at a caller's errors, as the header says.
#ifdef NDEBUG
constexpr bool kBadArguments = true;
#else
constexpr bool kBadArguments = false;
#endif

struct Objects {
  FuzzSource reads;
  ReaderPtr reader;
  TexturePtr texture;
  std::unique_ptr<btfc_scratch, void (*)(btfc_scratch*)> scratch{nullptr, btfc_scratch_free};
  std::unique_ptr<btfc_gpu_plan, void (*)(btfc_gpu_plan*)> plan{nullptr, btfc_gpu_plan_free};
  int slow_calls = 2;  // that make tiles of unbounded textures

  bool slow() { return btfc_texture_unbounded(texture.get()) != 0 && slow_calls-- <= 0; }
};

// Numbers at borders as often as others.
std::uint32_t number(Choices& choices) {
  static constexpr std::uint32_t kBorders[] = {0,   1,     2,     3,          4,          255,
                                               256, 65535, 65536, 0x7fffffff, 0x80000000, 0xffffffff};
  const std::uint8_t kind = choices.u8();
  if (kind < 128) return kind % 16u;
  return kind < 192 ? kBorders[kind % std::size(kBorders)] : choices.u16();
}

// A number below a bound, or where bad arguments are allowed now and then any.
std::uint32_t index(Choices& choices, std::uint32_t bound) {
  const std::uint32_t n = number(choices);
  return kBadArguments && n > 200 ? n : bound == 0 ? 0 : n % bound;
}

void check_map(btfc_result result, bool good) { FUZZ_CHECK(result == (good ? BTFC_OK : BTFC_BAD_ARGUMENT)); }

void open_reader(Objects& o, Choices& choices) {
  o.reader.reset();
  o.reads.good_reads = choices.u8() < 200 ? UINT32_MAX : choices.u8() % 16u;
  btfc_options options = bounded_options();
  const std::uint8_t kind = choices.u8();
  if (kind == 1) options.max_chunks = choices.u8();
  if (kind == 2) options.max_payload_bytes = choices.u16();
  btfc_source source = o.reads.source();
  btfc_reader* made = nullptr;
  btfc_error error{};
  if (kBadArguments && kind > 250) {
    options.struct_size = 4;
    FUZZ_CHECK(btfc_reader_open(&source, &options, &made, &error) == BTFC_BAD_ARGUMENT);
    FUZZ_CHECK(btfc_reader_open(nullptr, nullptr, &made, &error) == BTFC_BAD_ARGUMENT);
    FUZZ_CHECK(btfc_reader_open(&source, nullptr, nullptr, nullptr) == BTFC_BAD_ARGUMENT);
    FUZZ_CHECK(btfc_reader_open_memory(nullptr, 64, nullptr, &made, &error) == BTFC_BAD_ARGUMENT);
    FUZZ_CHECK(btfc_verify(nullptr, nullptr, &error) == BTFC_BAD_ARGUMENT);
    FUZZ_CHECK(made == nullptr);
    return;
  }
  const btfc_result result =
      kind % 2 ? btfc_reader_open(&source, &options, &made, &error)
               : btfc_reader_open_memory(o.reads.file.data(), o.reads.file.size(), &options, &made, &error);
  o.reader.reset(made);
  check_error(result, error);
  FUZZ_CHECK((result == BTFC_OK) == (made != nullptr));
  if (made != nullptr && !small_enough(made)) o.reader.reset();
}

// What the file says it is worth, and a selection of a point of it.
void choose(Objects& o, Choices& choices, btfc_selection& selection) {
  btfc_quality_info info{};
  btfc_error error{};
  btfc_result result = btfc_reader_quality(o.reader.get(), &info, nullptr, 0, &error);
  check_error(result, error);
  if (result != BTFC_OK) return;
  std::vector<btfc_quality_point> points(choices.u8() % 8u);
  FUZZ_CHECK(btfc_reader_quality(o.reader.get(), &info, points.data(), points.size(), &error) == BTFC_OK);
  FUZZ_CHECK((info.points == 0) == (info.measures == 0));
  for (std::size_t i = 0; i < points.size() && i < info.points; ++i) {
    FUZZ_CHECK(points[i].psnr_db <= 200 && points[i].distance >= 0 && std::isfinite(points[i].rate) &&
               std::isfinite(points[i].mae_lab));
  }
  btfc_wanted wanted{};
  wanted.struct_size = kBadArguments && choices.u8() == 255 ? 4 : sizeof wanted;
  const std::uint8_t kind = choices.u8();
  if (kind % 2) wanted.psnr_db = kind < 128 ? static_cast<float>(kind % 64u) : choices.f32();
  if (kind % 4 == 2) wanted.distance = choices.f32();
  if (kind % 8 == 4) wanted.operations = number(choices);
  if (!kBadArguments && (kind % 8 == 0 || info.points == 0)) return;
  const btfc_selection before = selection;
  btfc_quality_point point{};
  result = btfc_choose(o.reader.get(), &wanted, &selection, choices.u8() % 2 ? &point : nullptr, &error);
  check_error(result, error);
  FUZZ_CHECK(result == BTFC_OK || result == BTFC_BAD_ARGUMENT);
  FUZZ_CHECK(selection.period == before.period && selection.relief == before.relief);
  if (result != BTFC_OK) FUZZ_CHECK(selection.levels == before.levels && selection.gates == before.gates);
}

void load_texture(Objects& o, Choices& choices) {
  if (o.reader == nullptr) return;
  o.plan.reset();
  o.scratch.reset();
  o.texture.reset();
  btfc_selection selection{};
  selection.struct_size = kBadArguments && choices.u8() == 255 ? 8 : sizeof selection;
  selection.levels = choices.u8() % 16u;
  const std::uint8_t kind = choices.u8();
  if (kind < 32) selection.period = number(choices);
  if (kind % 4 == 3) selection.relief = number(choices);
  if (kind % 8 == 5) selection.gates = number(choices);
  if (kind % 8 == 6) selection.culling = choices.u8() % 2 ? 0.01f : choices.f32();
  if (kind > 239) choose(o, choices, selection);
  btfc_texture* made = nullptr;
  btfc_error error{};
  const btfc_result result =
      btfc_texture_load(o.reader.get(), kind == 33 ? nullptr : &selection, &made, &error);
  o.texture.reset(made);
  check_error(result, error);
  FUZZ_CHECK((result == BTFC_OK) == (made != nullptr));
}

void chunks(Objects& o, Choices& choices) {
  if (o.reader == nullptr) return;
  btfc_file_info info{};
  FUZZ_CHECK(btfc_reader_info(o.reader.get(), &info) == BTFC_OK);
  const std::uint32_t i = index(choices, info.chunks);
  btfc_chunk_info chunk{};
  check_map(btfc_reader_chunk_info(o.reader.get(), i, &chunk), i < info.chunks);
  if (i >= info.chunks) return;
  std::vector<std::uint8_t> raw(chunk.raw_bytes);
  btfc_error error{};
  if (kBadArguments && choices.u8() > 240) {
    FUZZ_CHECK(btfc_reader_read_chunk(o.reader.get(), i, raw.data(), raw.size() - 1, &error) ==
               BTFC_BAD_ARGUMENT);
    return;
  }
  check_error(btfc_reader_read_chunk(o.reader.get(), i, raw.data(), raw.size(), &error), error);
}

void describe(const btfc_texture* t, Choices& choices) {
  const std::uint32_t map = index(choices, btfc_texture_maps(t)),
                      view = index(choices, btfc_texture_views(t)),
                      light = index(choices, btfc_texture_lights(t)),
                      pair = index(choices, btfc_texture_pairs(t));
  btfc_map_info info{};
  check_map(btfc_texture_map_info(t, map, &info), map < btfc_texture_maps(t));
  float direction[3];
  check_map(btfc_texture_view(t, view, direction), view < btfc_texture_views(t));
  if (view < btfc_texture_views(t)) FUZZ_CHECK(std::isfinite(direction[0]) && direction[2] > -1e-3f);
  check_map(btfc_texture_light(t, light, direction), light < btfc_texture_lights(t));
  std::uint32_t v = 0, l = 0;
  check_map(btfc_texture_pair(t, pair, &v, &l), pair < btfc_texture_pairs(t));
  FUZZ_CHECK(v < btfc_texture_views(t) && l < btfc_texture_lights(t));
}

void domain(const btfc_texture* t, Choices& choices) {
  btfc_domain d{};
  FUZZ_CHECK(btfc_texture_domain(t, &d) == BTFC_OK);
  FUZZ_CHECK(d.views <= BTFC_DOMAIN_PAIRS && d.lights <= BTFC_DOMAIN_PAIRS && d.scale != 0);
  FUZZ_CHECK(d.tolerance >= 0 && d.radius >= 0 && d.footprint_least <= d.footprint_most);
  const std::uint32_t view = index(choices, d.view_count), light = index(choices, d.light_count);
  float direction[3] = {};
  if (view < d.view_count || kBadArguments)
    check_map(btfc_domain_view(t, view, direction), view < d.view_count);
  if (light < d.light_count || kBadArguments)
    check_map(btfc_domain_light(t, light, direction), light < d.light_count);
  for (const float c : direction) FUZZ_CHECK(std::isfinite(c));
  float look[2][3];
  const std::uint8_t kind = choices.u8();
  for (float& c : look[0]) c = kind < 64 ? choices.f32() : static_cast<std::int8_t>(choices.u8()) / 64.0f;
  for (float& c : look[1]) c = kind % 2 ? choices.f32() : static_cast<std::int8_t>(choices.u8()) / 64.0f;
  const float footprint = kind % 4 ? static_cast<float>(choices.u8()) : choices.f32();
  const std::uint32_t covered = btfc_covers(t, look[0], look[1], footprint);
  FUZZ_CHECK((covered & ~BTFC_COVERS_ALL) == 0);
  FUZZ_CHECK(covered == btfc_covers(t, look[0], look[1], footprint));
}

void eval(Objects& o, Choices& choices) {
  const btfc_texture* t = o.texture.get();
  const std::uint32_t count = choices.u8() % 8 == 0 ? 260 : choices.u8() % 8u;
  if ((count > 8 || o.scratch != nullptr) && o.slow()) return;
  struct Wide {
    btfc_query query;
    std::uint32_t more[3];
  };
  std::vector<Wide> queries(count);
  const std::uint32_t map = index(choices, btfc_texture_maps(t));
  const auto x = static_cast<std::int32_t>(number(choices)), y = static_cast<std::int32_t>(number(choices));
  const float footprint = choices.u8() < 32 ? choices.f32() : 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    queries[i].query = {};
    queries[i].query.map = i % 2 == 0 ? map : 0;
    queries[i].query.x = x;
    queries[i].query.y = y;
    queries[i].query.light[2] = static_cast<float>(i);
    queries[i].query.view[0] = footprint;
    queries[i].query.footprint = footprint;
  }
  std::vector<float> values(std::size_t{count} * 5);
  const bool good = count == 0 || map < btfc_texture_maps(t);
  check_map(btfc_eval(t, o.scratch.get(), count == 0 ? nullptr : &queries[0].query, sizeof(Wide), count,
                      values.data(), 5),
            good);
}

void texels(Objects& o, Choices& choices) {
  const btfc_texture* t = o.texture.get();
  const std::uint32_t count = choices.u8() % 8 == 0 ? 270 : choices.u8() % 8u,
                      map = index(choices, btfc_texture_maps(t));
  if ((count > 8 || o.scratch != nullptr) && o.slow()) return;
  std::vector<std::int32_t> at(2 * std::size_t{count});
  for (std::size_t i = 0; i < at.size(); ++i)
    at[i] = i < 4 ? static_cast<std::int32_t>(number(choices)) : static_cast<std::int32_t>(i);
  const std::uint32_t sample = index(choices, 4);
  std::vector<std::uint8_t> out(std::size_t{count} * 16);
  const bool good = count == 0 || (map < btfc_texture_maps(t) && sample < 4);
  if (!kBadArguments && !good) return;
  check_map(btfc_decode_texels(t, o.scratch.get(), map, nullptr, at.data(), count,
                               static_cast<btfc_sample>(sample & 3), out.data(), out.size()),
            count == 0 || map < btfc_texture_maps(t));
}

void rect(Objects& o, Choices& choices) {
  const btfc_texture* t = o.texture.get();
  if (o.slow()) return;
  const std::uint32_t width = choices.u8() % 40u, height = choices.u8() % 20u,
                      map = index(choices, btfc_texture_maps(t));
  const auto x = static_cast<std::int32_t>(number(choices)), y = static_cast<std::int32_t>(number(choices));
  const std::size_t row = width * 16 + choices.u8() % 3u;
  std::vector<std::uint8_t> out(row * height);
  btfc_directions d{};
  d.view[0] = choices.u8() < 16 ? choices.f32() : 0.5f;
  d.light[1] = static_cast<float>(static_cast<std::int8_t>(choices.u8()));
  d.light[2] = 1;
  d.level = number(choices);
  d.footprint = static_cast<float>(choices.u8());
  const bool ends = std::int64_t{x} + width - 1 <= INT32_MAX && std::int64_t{y} + height - 1 <= INT32_MAX;
  const bool good = width == 0 || height == 0 || (map < btfc_texture_maps(t) && ends);
  if (!kBadArguments && !good) return;
  const auto sample = static_cast<btfc_sample>(choices.u8() % 4);
  check_map(btfc_decode_rect(t, o.scratch.get(), map, choices.u8() % 2 ? &d : nullptr, x, y, width, height,
                             sample, out.data(), row, out.size()),
            good);
  if (kBadArguments && width != 0 && height != 0 && map < btfc_texture_maps(t)) {
    check_map(btfc_decode_rect(t, nullptr, map, nullptr, 0, 0, width, height, sample, out.data(), row,
                               row * height / 32),
              false);
  }
}

void gpu(Objects& o, Choices& choices) {
  const btfc_texture* t = o.texture.get();
  o.plan.reset();
  btfc_gpu_window window{};
  window.x = static_cast<std::int32_t>(number(choices));
  window.y = static_cast<std::int32_t>(number(choices));
  window.width = number(choices);
  window.height = number(choices);
  btfc_gpu_plan* made = nullptr;
  btfc_error error{};
  const btfc_result result = btfc_gpu_plan_new(t, choices.u8() % 8 ? &window : nullptr, &made, &error);
  o.plan.reset(made);
  check_error(result, error);
  FUZZ_CHECK((result == BTFC_OK) == (made != nullptr));
  if (made == nullptr) return;
  const btfc_gpu_plan_info* info = btfc_gpu_plan_get(made);
  FUZZ_CHECK(info->map_count == btfc_texture_maps(t));
  for (std::uint32_t i = 0; i < BTFC_WORD_SLOTS; ++i) {
    FUZZ_CHECK(info->words_size[i] >= 4 && info->words_size[i] <= std::uint64_t{1} << 27);
    FUZZ_CHECK(info->words_upload[i] == btfc_gpu_words_size(t, i) &&
               info->words_upload[i] <= info->words_size[i]);
  }
  for (std::uint32_t i = 0; i < info->pass_count; ++i) {
    const btfc_gpu_pass& pass = info->passes[i];
    FUZZ_CHECK(pass.push_size <= sizeof pass.push && pass.groups[0] * pass.groups[1] * pass.groups[2] != 0);
    FUZZ_CHECK(pass.groups[0] <= 65535 && pass.groups[1] <= 65535 && pass.groups[2] <= 65535);
  }
}

void words(const btfc_texture* t, Choices& choices) {
  const std::uint32_t slot = index(choices, BTFC_WORD_SLOTS), map = index(choices, btfc_texture_maps(t)),
                      plane = index(choices, btfc_gpu_planes(t));
  std::vector<std::uint8_t> out(btfc_gpu_words_size(t, slot));
  check_map(btfc_gpu_write_words(t, slot, out.data(), out.size()), slot < BTFC_WORD_SLOTS);
  std::vector<std::uint8_t> params(btfc_gpu_params_size(t, map));
  check_map(btfc_gpu_write_params(t, map, params.data(), params.size()), map < btfc_texture_maps(t));
  btfc_plane_info info{};
  if (plane < btfc_gpu_planes(t) || kBadArguments)
    check_map(btfc_gpu_plane_info(t, plane, &info), plane < btfc_gpu_planes(t));
  if (plane < btfc_gpu_planes(t)) {
    const std::uint64_t bits = std::uint64_t{info.width} * info.height * info.texel_bits;
    FUZZ_CHECK(4 * std::uint64_t{info.first_word} + bits / 8 <= btfc_gpu_words_size(t, info.slot));
  }
  std::size_t size = 0;
  static constexpr const char* kNames[] = {"btfc_decode.comp", "btfc_full.vert", "nothing"};
  const std::uint32_t* code = btfc_gpu_shader(kNames[choices.u8() % 3], &size);
  FUZZ_CHECK((code == nullptr) == (size == 0));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const FileInput input = file_input(data, size);
  Choices choices(input.choices);
  Objects o;
  o.reads.file = input.file();
  FUZZ_CHECK(btfc_version()[0] != '\0' &&
             btfc_result_name(static_cast<btfc_result>(choices.u8() % 8))[0] != '\0');
  open_reader(o, choices);
  load_texture(o, choices);
  while (choices.left() > 0) {
    const std::uint8_t call = choices.u8();
    const btfc_texture* t = o.texture.get();
    if (call % 17 == 0) open_reader(o, choices);
    if (call % 17 == 1) load_texture(o, choices);
    if (call % 17 == 2) chunks(o, choices);
    if (call % 17 == 3) o.reader.reset();  // a texture does not need it
    if (t == nullptr) continue;
    if (call % 17 == 4) {
      o.scratch.reset(btfc_scratch_new(t));
      FUZZ_CHECK(o.scratch != nullptr);
    }
    if (call % 17 == 5) o.scratch.reset();
    if (call % 17 == 6) describe(t, choices);
    if (call % 17 == 7 || call % 17 == 8) eval(o, choices);
    if (call % 17 == 9 || call % 17 == 10) texels(o, choices);
    if (call % 17 == 11 || call % 17 == 12) rect(o, choices);
    if (call % 17 == 13 || call % 17 == 14) gpu(o, choices);
    if (call % 17 == 15) words(t, choices);
    if (call % 17 == 16) domain(t, choices);
  }
  FUZZ_CHECK(!o.reads.outside);
  FUZZ_CHECK(btfc_gpu_plan_get(nullptr) == nullptr && btfc_scratch_new(nullptr) == nullptr);
  return 0;
}
