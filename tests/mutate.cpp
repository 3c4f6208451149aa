// btfc_mutate: random damage to valid files, through everything that the C interface does with a file.
//
// btfc_mutate COUNT [--seed N] [--from NUMBER] [--only NUMBER] [--keep FOLDER] [FILE or FOLDER ...]
// Seeds default to every model's vectors. Each mutation follows from --seed and its number alone: --only
// makes one again.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>

#include "encoder/output/atomic_file.h"
#include "tests/mutation.h"
#include "tests/test_support.h"

// Of the sanitizers, where they are linked: says which mutation ended the program.
extern "C" void __sanitizer_set_death_callback(void (*callback)()) __attribute__((weak));

namespace btfc::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kMostPayloadBytes = 16u << 20;
constexpr std::uint64_t kFullDecodeTexels = 512 * 512;

struct Arguments {
  std::uint64_t count = 0, run = 1, from = 0;
  std::string keep;
  std::vector<std::string> paths;
};

struct Counts {
  std::array<std::uint64_t, kDamageKinds> made{}, valid{}, loaded{};
  std::map<std::string, std::array<std::uint64_t, kDamageKinds>> refused;  // verify's rule, or result's name
  std::map<std::string, std::uint64_t> loads_though;                       // refused by verify, yet loads
  std::uint64_t decoded_whole = 0, decoded_part = 0, texels = 0, findings = 0;
  double slowest = 0;
  std::uint64_t slowest_number = 0;
};

std::uint64_t g_number = 0, g_run = 0;

void say_where() {
  std::printf("mutation %llu of run %llu ended the program: --seed %llu --only %llu\n",
              static_cast<unsigned long long>(g_number), static_cast<unsigned long long>(g_run),
              static_cast<unsigned long long>(g_run), static_cast<unsigned long long>(g_number));
  std::fflush(stdout);
}

// The file in memory of exactly its size, so that a read beyond is noticed.
struct Memory {
  explicit Memory(const Bytes& file) : size(file.size()), data(new std::uint8_t[file.size()]) {
    std::copy(file.begin(), file.end(), data.get());
  }
  static int read(void* user, std::uint64_t offset, void* to, std::size_t size) {
    auto* memory = static_cast<Memory*>(user);
    if (offset > memory->size || size > memory->size - offset) {
      memory->outside = true;
      return 1;
    }
    if (size != 0) std::memcpy(to, memory->data.get() + offset, size);
    return 0;
  }
  std::size_t size;
  std::unique_ptr<std::uint8_t[]> data;
  bool outside = false;
};

std::size_t sample_bytes(btfc_sample sample) {
  return sample == BTFC_FLOAT32 ? 4 : sample == BTFC_UNORM8 ? 1 : 2;
}

// A rectangle over a buffer of its exact size, filled with a pattern beforehand: a sample that is not written
// shows as a difference between two fills.
template <class T>
bool decode_rect(const btfc_texture* t, std::uint32_t map, const std::array<std::uint32_t, 4>& r,
                 btfc_sample sample, std::size_t texel_bytes, int fill, std::vector<T>& out) {
  const std::size_t row = r[2] * texel_bytes, size = row * r[3];
  out.resize(size / sizeof(T));
  if (size != 0) std::memset(out.data(), fill, size);
  return btfc_decode_rect(t, nullptr, map, nullptr, static_cast<int>(r[0]), static_cast<int>(r[1]), r[2],
                          r[3], sample, out.data(), row, size) == BTFC_OK;
}

// What is wrong with a rectangle of a map, or nullptr. same_bits: whether a rectangle gives exactly what
// single texels give; otherwise they are near each other where a file's numbers are sound, which damaged ones
// are not.
const char* rect_fault(const btfc_texture* t, std::uint32_t map, const std::array<std::uint32_t, 4>& r,
                       bool same_bits, Random& random) {
  btfc_map_info info{};
  btfc_texture_map_info(t, map, &info);
  const std::size_t bytes = info.channels * sample_bytes(info.sample);
  std::vector<std::uint8_t> codes, again;
  std::vector<float> values;
  if (!decode_rect(t, map, r, info.sample, bytes, 0xaa, codes) ||
      !decode_rect(t, map, r, info.sample, bytes, 0x55, again) ||
      !decode_rect(t, map, r, BTFC_FLOAT32, 4 * info.channels, 0xff, values))
    return "btfc_decode_rect failed";
  if (codes != again) return "two decodes differ";
  for (const float v : values) {
    if (!std::isfinite(v)) return "a decoded value is not finite";
  }
  // Single texels, in the rectangle, against it; and far outside.
  for (int n = 0; n < 6; ++n) {
    const std::size_t u = random.below(r[2]), v = random.below(r[3]), at = v * r[2] + u;
    btfc_query query{};
    query.map = map;
    query.x = static_cast<std::int32_t>(r[0] + u);
    query.y = static_cast<std::int32_t>(r[1] + v);
    float value[4];
    if (btfc_eval(t, nullptr, &query, sizeof query, 1, value, 4) != BTFC_OK) return "btfc_eval failed";
    for (std::uint32_t c = 0; c < info.channels; ++c) {
      if (!std::isfinite(value[c])) return "a value of btfc_eval is not finite";
    }
    if (same_bits && std::memcmp(value, &values[at * info.channels], 4 * info.channels) != 0)
      return "btfc_eval and rect differ";
    const std::int32_t texel[2] = {query.x, query.y};
    std::uint8_t code[8];
    if (btfc_decode_texels(t, nullptr, map, nullptr, texel, 1, info.sample, code, bytes) != BTFC_OK)
      return "btfc_decode_texels failed";
    if (same_bits && std::memcmp(code, &codes[at * bytes], bytes) != 0)
      return "btfc_decode_texels and rect differ";
  }
  for (const auto& [x, y] :
       {std::pair(INT32_MIN, INT32_MAX), std::pair(INT32_MAX, INT32_MIN), std::pair(-1, -1)}) {
    btfc_query query{};
    query.map = map;
    query.x = x;
    query.y = y;
    float value[4];
    if (btfc_eval(t, nullptr, &query, sizeof query, 1, value, 4) != BTFC_OK || !std::isfinite(value[0]))
      return "btfc_eval far outside failed";
  }
  return nullptr;
}

const char* texture_fault(const btfc_texture* t, bool same_bits, Random& random, Counts& counts) {
  const std::uint32_t width = btfc_texture_width(t), height = btfc_texture_height(t);
  const bool whole = std::uint64_t{width} * height <= kFullDecodeTexels;
  std::vector<std::array<std::uint32_t, 4>> rects = {{0, 0, width, height}};
  if (!whole) {
    const std::uint32_t w = std::min(width, 64u), h = std::min(height, 64u);
    rects = {{0, 0, w, h}, {width - w, height - h, w, h}, {width / 2 - w / 2, height / 2 - h / 2, w, h}};
  }
  ++(whole ? counts.decoded_whole : counts.decoded_part);
  for (std::uint32_t m = 0; m < btfc_texture_maps(t); ++m) {
    for (const auto& r : rects) {
      counts.texels += std::uint64_t{r[2]} * r[3];
      if (const char* fault = rect_fault(t, m, r, same_bits, random)) return fault;
    }
  }
  return nullptr;
}

// zstd has more than one frame for the same bytes, and a mutation may change nothing: what passes hashes that
// nobody made right must be what was stored.
bool same_contents(const Bytes& file, const Seed& seed) {
  const ByteView view(file);
  const Result<Directory> directory = read_directory(source_of(view));
  if (!directory) return false;
  const Result<std::vector<RawChunk>> chunks = read_all_chunks(source_of(view), *directory);
  return chunks && std::equal(chunks->begin(), chunks->end(), seed.chunks.begin(), seed.chunks.end(),
                              [](const RawChunk& a, const RawChunk& b) {
                                return a.key.order() == b.key.order() && a.raw == b.raw;
                              });
}

// Everything with one file; what is wrong, or nullptr.
const char* file_fault(const Mutant& mutant, const Seed& seed, Random& random, Counts& counts) {
  const auto kind = static_cast<std::size_t>(mutant.damage);
  Memory memory(mutant.file);
  const btfc_source source = {Memory::read, &memory, memory.size};
  btfc_options options{};
  options.struct_size = sizeof options;
  options.max_payload_bytes = kMostPayloadBytes;
  btfc_error error{};
  const btfc_result verified = btfc_verify(&source, &options, &error);
  std::string rule;
  if (verified == BTFC_OK) {
    ++counts.valid[kind];
  } else {
    if (verified != error.result) return "btfc_verify and its error disagree";
    if (std::memchr(error.rule, 0, sizeof error.rule) == nullptr ||
        std::memchr(error.message, 0, sizeof error.message) == nullptr)
      return "an error's text has no end";
    if (error.message[0] == '\0') return "an error without a message";
    if (verified == BTFC_INVALID_FILE && error.rule[0] == '\0') return "an invalid file without a rule";
    if (verified == BTFC_BAD_ARGUMENT || verified == BTFC_IO) return "verify blames its caller or the source";
    rule = error.rule[0] != '\0' ? error.rule : btfc_result_name(verified);
    ++counts.refused[rule][kind];
  }
  if (verified == BTFC_OK && mutant.damage == Damage::bytes && !same_contents(mutant.file, seed))
    return "a change passed the hashes";
  if (memory.outside) return "a read outside the file was asked for";

  btfc_reader* reader = nullptr;
  btfc_texture* texture = nullptr;
  btfc_result loaded = btfc_reader_open_memory(memory.data.get(), memory.size, &options, &reader, &error);
  if (loaded == BTFC_OK) loaded = btfc_texture_load(reader, nullptr, &texture, &error);
  const std::unique_ptr<btfc_reader, ReaderFree> reader_owned(reader);
  const TexturePtr owned(texture);
  if ((loaded == BTFC_OK) != (texture != nullptr)) return "load's result and its texture disagree";
  if (verified == BTFC_OK && loaded != BTFC_OK) return "a valid file does not load";
  if (loaded != BTFC_OK) return nullptr;
  ++counts.loaded[kind];
  if (verified != BTFC_OK) ++counts.loads_though[rule];
  btfc_file_info info{};
  if (btfc_reader_info(reader, &info) != BTFC_OK) return "btfc_reader_info failed";
  // Of gm and of random fields rectangles are near single texels, not the same bits.
  return texture_fault(texture, std::string(info.model) != "gm" && info.unbounded == 0, random, counts);
}

void progress(const Counts& counts, std::uint64_t done, double seconds) {
  std::uint64_t loaded = 0;
  for (const std::uint64_t n : counts.loaded) loaded += n;
  std::printf(
      "%10llu mutations, %llu loaded and decoded, %llu findings, %.0f s, %.0f/s, slowest %.1f ms (number "
      "%llu)\n",
      static_cast<unsigned long long>(done), static_cast<unsigned long long>(loaded),
      static_cast<unsigned long long>(counts.findings), seconds, static_cast<double>(done) / seconds,
      1e3 * counts.slowest, static_cast<unsigned long long>(counts.slowest_number));
  std::fflush(stdout);
}

void report(const Counts& counts) {
  const auto row = [](const std::string& name, const std::array<std::uint64_t, kDamageKinds>& n) {
    std::printf("%-22s %12llu %12llu %12llu\n", name.c_str(), static_cast<unsigned long long>(n[0]),
                static_cast<unsigned long long>(n[1]), static_cast<unsigned long long>(n[2]));
  };
  std::printf("\n%-22s %12s %12s %12s\n", "", "hashes kept", "repaired", "reshaped");
  row("mutations", counts.made);
  row("valid", counts.valid);
  row("loaded", counts.loaded);
  std::printf("refused by\n");
  for (const auto& [rule, n] : counts.refused) row("  " + rule, n);
  std::printf("%llu decoded whole, %llu in part, %llu texels three times each\n",
              static_cast<unsigned long long>(counts.decoded_whole),
              static_cast<unsigned long long>(counts.decoded_part),
              static_cast<unsigned long long>(counts.texels));
  for (const auto& [rule, n] : counts.loads_though)
    std::printf("%llu break %s, which a reader that does not verify may leave unseen, and load\n",
                static_cast<unsigned long long>(n), rule.c_str());
}

std::vector<Seed> read_seeds(std::vector<std::string> paths) {
  if (paths.empty()) {
    for (const ModelFormat& model : models()) paths.push_back(std::string(BTFC_VECTORS) + "/" + model.name);
  }
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (!std::filesystem::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      if (entry.path().extension() == ".btfc") files.push_back(entry.path().string());
    }
  }
  // Numbers of mutations mean the same on every file system.
  std::sort(files.begin(), files.end());
  std::vector<Seed> seeds;
  for (const std::string& file : files) {
    Result<Bytes> bytes = read_file(file);
    Result<Seed> seed =
        bytes ? make_seed(file.substr(file.rfind('/') + 1), *std::move(bytes)) : Result<Seed>(bytes.error());
    if (seed) {
      seeds.push_back(*std::move(seed));
    } else {
      std::fprintf(stderr, "btfc_mutate: '%s' is left out: %s\n", file.c_str(), seed.error().message.c_str());
    }
  }
  return seeds;
}

bool parse(int argc, char** argv, Arguments& a) {
  const auto number = [](const char* text, std::uint64_t& to) {
    char* end = nullptr;
    to = std::strtoull(text, &end, 10);
    return end != text && *end == '\0';
  };
  if (argc < 2 || !number(argv[1], a.count)) return false;
  for (int i = 2; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg.rfind("--", 0) != 0) {
      a.paths.push_back(arg);
      continue;
    }
    if (i + 1 == argc) return false;
    const char* value = argv[++i];
    if (arg == "--keep") {
      a.keep = value;
    } else if (arg == "--seed") {
      if (!number(value, a.run)) return false;
    } else if (arg == "--from" || arg == "--only") {
      if (!number(value, a.from)) return false;
      if (arg == "--only") a.count = 1;
    } else {
      return false;
    }
  }
  return true;
}

int run(const Arguments& a) {
  const std::vector<Seed> seeds = read_seeds(a.paths);
  if (seeds.empty()) {
    std::fprintf(stderr, "btfc_mutate: there is no seed file\n");
    return 1;
  }
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(say_where);
  g_run = a.run;
  std::printf("%zu seed files, run %llu\n", seeds.size(), static_cast<unsigned long long>(a.run));
  Counts counts;
  const auto begin = Clock::now();
  auto last = begin, shown = begin;
  for (std::uint64_t i = 0; i < a.count; ++i) {
    g_number = a.from + i;
    const Mutant mutant = mutate(seeds, a.run, g_number);
    ++counts.made[static_cast<std::size_t>(mutant.damage)];
    Random random(g_number);
    const char* fault = file_fault(mutant, seeds[mutant.seed], random, counts);
    if (fault != nullptr && ++counts.findings <= 20) {
      std::printf("FINDING: mutation %llu of %s: %s\n", static_cast<unsigned long long>(g_number),
                  seeds[mutant.seed].name.c_str(), fault);
    }
    if (!a.keep.empty() && (fault != nullptr || a.count == 1)) {
      const std::string path = a.keep + "/mutant-" + std::to_string(g_number) + ".btfc";
      if (!write_file(path, mutant.file))
        std::fprintf(stderr, "btfc_mutate: could not write '%s'\n", path.c_str());
    }
    const auto now = Clock::now();
    const double spent = std::chrono::duration<double>(now - last).count();
    if (spent > counts.slowest) {
      counts.slowest = spent;
      counts.slowest_number = g_number;
    }
    last = now;
    if (now - shown > std::chrono::seconds(15)) {
      shown = now;
      progress(counts, i + 1, std::chrono::duration<double>(now - begin).count());
    }
  }
  progress(counts, a.count, std::chrono::duration<double>(Clock::now() - begin).count());
  report(counts);
  return counts.findings == 0 ? 0 : 1;
}

}  // namespace
}  // namespace btfc::test

int main(int argc, char** argv) {
  btfc::test::Arguments arguments;
  if (!btfc::test::parse(argc, argv, arguments)) {
    std::fprintf(
        stderr,
        "usage: btfc_mutate COUNT [--seed N] [--from NUMBER] [--only NUMBER] [--keep FOLDER] [FILE ...]\n");
    return 1;
  }
  return btfc::test::run(arguments);
}
