// Damaged files of every model: refused or decoded within limits, never a crash (run under ASan and UBSan
// too).
#include <bit>
#include <fstream>

#include "encoder/output/atomic_file.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

struct Smallest {
  std::filesystem::path path;
  Bytes file;
};

Bytes read_vector(const std::filesystem::path& path) {
  const Result<Bytes> bytes = read_file(path.string());
  EXPECT_TRUE(bytes) << path;
  return bytes ? *bytes : Bytes();
}

// All chunks' raw bytes.
std::vector<Bytes> contents(const Bytes& file) {
  std::vector<Bytes> all;
  const ByteView view(file);
  const Result<Directory> directory = read_directory(source_of(view));
  if (!directory) return all;
  Result<std::vector<RawChunk>> chunks = read_all_chunks(source_of(view), *directory);
  if (!chunks) return all;
  for (RawChunk& chunk : *chunks) all.push_back(std::move(chunk.raw));
  return all;
}

// What a user of the library would do with a file: verify it, load it, decode some of it. Returns whether it
// loads.
bool exercise(const Bytes& file) {
  const bool valid = static_cast<bool>(verify_bytes(file));
  const TexturePtr texture = load(file);
  if (valid) {
    EXPECT_TRUE(texture) << "a valid file does not load";
  }
  if (!texture) return false;
  const std::uint32_t width = btfc_texture_width(texture.get()), height = btfc_texture_height(texture.get());
  // Rectangles of an unbounded texture make whole tiles, which takes milliseconds: those of every 32nd file.
  static unsigned unbounded_files = 0;
  const bool rectangles = btfc_texture_unbounded(texture.get()) == 0 || unbounded_files++ % 32 == 0;
  for (std::uint32_t m = 0; m < btfc_texture_maps(texture.get()); ++m) {
    const std::uint32_t w = std::min(width, 16u), h = std::min(height, 16u);
    std::vector<float> values(std::size_t{w} * h * 4);
    for (const auto& [x, y] : {std::pair(0u, 0u), std::pair(width - w, height - h)}) {
      if (!rectangles) break;
      const btfc_result result =
          btfc_decode_rect(texture.get(), nullptr, m, nullptr, static_cast<int>(x), static_cast<int>(y), w, h,
                           BTFC_FLOAT32, values.data(), w * 16, values.size() * 4);
      EXPECT_EQ(result, BTFC_OK);
    }
    btfc_query far{};
    far.map = m;
    far.x = INT32_MIN;
    far.y = INT32_MAX;
    EXPECT_EQ(btfc_eval(texture.get(), nullptr, &far, sizeof far, 1, values.data(), 4), BTFC_OK);
    for (int c = 0; c < 4; ++c)
      EXPECT_TRUE(values[static_cast<std::size_t>(c)] == values[static_cast<std::size_t>(c)]);
  }
  return true;
}

class Hostile : public testing::TestWithParam<const char*> {};

TEST_P(Hostile, EveryModelHasVectors) { EXPECT_GE(vectors_of(GetParam()).size(), 3u); }

TEST_P(Hostile, VectorsAreValid) {
  for (const auto& path : vectors_of(GetParam())) {
    const Result<Done> verified = verify_bytes(read_vector(path));
    EXPECT_TRUE(verified) << path << ": " << (verified ? "" : verified.error().message);
  }
}

TEST_P(Hostile, EveryTruncationIsRefused) {
  for (const auto& path : vectors_of(GetParam())) {
    const Bytes whole = read_vector(path);
    const std::size_t step = whole.size() > 4096 ? 7 : 1;
    for (std::size_t size = 0; size < whole.size(); size += step) {
      Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_FALSE(verify_bytes(part)) << path << " cut to " << size;
      EXPECT_FALSE(load(part));
      // The same with a header that admits the new size.
      if (size < kHeaderBytes) continue;
      store_u64(&part[32], size);
      repair_hashes(part);
      EXPECT_FALSE(verify_bytes(part)) << path << " cut to " << size;
      exercise(part);
    }
  }
}

// Every byte of the smallest vector takes every value; as it is (a hash or a rule must notice) and with the
// hashes made right.
TEST_P(Hostile, EveryByteOfASmallFile) {
  Smallest small;
  for (const auto& path : vectors_of(GetParam())) {
    Bytes file = read_vector(path);
    if (small.file.empty() || file.size() < small.file.size()) small = {path, std::move(file)};
  }
  const auto original = contents(small.file);
  std::size_t reached = 0, compatible_bits = 0;
  for (std::size_t at = 0; at < small.file.size(); ++at) {
    // All values where the file is tiny, else single bits and a few more.
    for (unsigned value = 1; value < 256; ++value) {
      const bool telling = std::has_single_bit(value) || value == 0xff || value == 0x7f || value == 0x55;
      if (small.file.size() > 500 && !telling) continue;
      Bytes file = small.file;
      file[at] = static_cast<std::uint8_t>(file[at] ^ value);
      // zstd has more than one frame for the same bytes: what passes the hashes must be what was stored.
      if (verify_bytes(file)) {
        EXPECT_TRUE(contents(file) == original) << "byte " << at << " ^ " << value;
      }
      if (value % 5 == 0) exercise(file);
      repair_hashes(file);
      if (exercise(file)) ++reached;
      if (at >= 20 && at < 24) ++compatible_bits;
    }
  }
  // Sample codes and the like may take any value: many of the repaired files decode.
  EXPECT_GT(reached, compatible_bits);
  std::printf("%s: %zu bytes, %zu changes decoded after their hashes were repaired\n",
              small.path.filename().c_str(), small.file.size(), reached);
}

// All vectors, a few values a byte.
TEST_P(Hostile, SomeValuesOfEveryByte) {
  std::size_t changed = 0, reached = 0, same = 0;
  for (const auto& path : vectors_of(GetParam())) {
    const Bytes whole = read_vector(path);
    const auto original = contents(whole);
    const std::size_t step = 1 + whole.size() / 512;
    for (std::size_t at = 0; at < whole.size(); at += step) {
      for (const unsigned value : {0x01u, 0x80u, 0xffu}) {
        Bytes file = whole;
        file[at] = static_cast<std::uint8_t>(file[at] ^ value);
        // zstd has more than one frame for the same bytes: what passes the hashes must be what was stored.
        if (verify_bytes(file)) {
          EXPECT_TRUE(contents(file) == original) << path << " byte " << at << " ^ " << value;
          ++same;
        }
        repair_hashes(file);
        ++changed;
        if (exercise(file)) ++reached;
      }
    }
  }
  EXPECT_GT(reached, 0u);
  std::printf("%zu changes, %zu of them without effect on any chunk; with repaired hashes %zu decoded\n",
              changed, same, reached);
}

INSTANTIATE_TEST_SUITE_P(Models, Hostile, testing::ValuesIn([] {
                           std::vector<const char*> names;
                           for (const ModelFormat& model : models()) names.push_back(model.name);
                           return names;
                         }()),
                         [](const auto& test) { return std::string(test.param); });

// A reader's own limits are told apart from broken files.
TEST(Limits, PayloadAndChunks) {
  const Bytes file = encode("patch", noise(16, 16, 3, SampleType::unorm8), {{"k", "2"}});
  btfc_reader* reader = nullptr;
  btfc_error error{};
  btfc_options options{};
  options.struct_size = sizeof options;
  options.max_payload_bytes = 100;
  EXPECT_EQ(btfc_reader_open_memory(file.data(), file.size(), &options, &reader, &error), BTFC_LIMIT);
  EXPECT_EQ(reader, nullptr);
  EXPECT_NE(std::string(error.message).find("limit is 100"), std::string::npos);
  options.max_payload_bytes = 0;
  options.max_chunks = 2;
  EXPECT_EQ(btfc_reader_open_memory(file.data(), file.size(), &options, &reader, &error), BTFC_LIMIT);
  options.max_chunks = 0;
  ASSERT_EQ(btfc_reader_open_memory(file.data(), file.size(), &options, &reader, &error), BTFC_OK)
      << error.message;
  btfc_reader_free(reader);
}

}  // namespace
}  // namespace btfc::test
