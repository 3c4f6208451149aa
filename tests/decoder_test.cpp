// The C interface: rectangles, texels and queries agree for every model; partial loads; conversions; threads.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <thread>

#include "encoder/output/atomic_file.h"
#include "shaders/models/patch.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

constexpr std::size_t kSampleBytes[] = {1, 2, 2, 4};

Bytes read_vector(const std::filesystem::path& path) {
  const Result<Bytes> bytes = read_file(path.string());
  EXPECT_TRUE(bytes) << path;
  return bytes ? *bytes : Bytes();
}

class EveryModel : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, EveryModel, testing::ValuesIn([] {
                           std::vector<const char*> names;
                           for (const ModelFormat& model : models()) names.push_back(model.name);
                           return names;
                         }()),
                         [](const auto& test) { return std::string(test.param); });

// Samples of a kind that a decoder gave, as numbers.
std::vector<double> numbers_of(const std::uint8_t* from, std::size_t count, btfc_sample sample) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* p = from + i * kSampleBytes[sample];
    float value = 0;
    if (sample == BTFC_FLOAT32) std::memcpy(&value, p, sizeof value);
    out[i] = sample == BTFC_UNORM8    ? *p / 255.0
             : sample == BTFC_UNORM16 ? load_u16(p) / 65535.0
             : sample == BTFC_FLOAT16 ? btfc_half_to_float(load_u16(p))
                                      : value;
  }
  return out;
}

// Whether two ways of decoding say the same of samples. `error` is what the file states (car.md 1): each way
// may be so far from the stationary solution. Rounding comes on top of it, in steps of the sample and by
// 1e-5 of values.
bool agree(const std::uint8_t* a, const std::uint8_t* b, std::size_t count, btfc_sample sample,
           double error) {
  if (error == 0) return std::memcmp(a, b, count * kSampleBytes[sample]) == 0;
  const std::vector<double> x = numbers_of(a, count, sample), y = numbers_of(b, count, sample);
  for (std::size_t i = 0; i < count; ++i) {
    const double size = std::max({1.0, std::abs(x[i]), std::abs(y[i])});
    const double step = sample == BTFC_UNORM8    ? 1 / 255.0
                        : sample == BTFC_UNORM16 ? 1 / 65535.0
                        : sample == BTFC_FLOAT16 ? size / 1024
                                                 : 0;
    if (!(std::abs(x[i] - y[i]) <= 2 * error + 1e-5 * size + 1.01 * step)) return false;
  }
  return true;
}

// The fast rows, the batch of texels and the float queries give the same, in every sample type, inside and
// outside; of random fields the same within the file's error.
TEST_P(EveryModel, RectanglesTexelsAndQueriesAgree) {
  for (const auto& path : vectors_of(GetParam())) {
    const Bytes file = read_vector(path);
    const TexturePtr t = load(file);
    ASSERT_TRUE(t) << path;
    const double error = stated_error(file);
    const auto width = static_cast<std::int32_t>(btfc_texture_width(t.get()));
    const auto height = static_cast<std::int32_t>(btfc_texture_height(t.get()));
    for (std::uint32_t m = 0; m < btfc_texture_maps(t.get()); ++m) {
      btfc_map_info info{};
      ASSERT_EQ(btfc_texture_map_info(t.get(), m, &info), BTFC_OK);
      for (const btfc_sample sample : {BTFC_UNORM8, BTFC_UNORM16, BTFC_FLOAT16, BTFC_FLOAT32}) {
        const std::size_t texel = info.channels * kSampleBytes[sample];
        struct Rect {
          std::int32_t x, y, w, h;
        };
        for (const Rect& r : {Rect{0, 0, width, height}, Rect{width / 3, height / 2, width - width / 3, 1},
                              Rect{-3, -2, width + 5, height + 4}}) {
          const auto w = static_cast<std::size_t>(r.w), h = static_cast<std::size_t>(r.h);
          const std::size_t stride = w * texel + 3;
          Bytes rect(stride * h, 0xCD);
          ASSERT_EQ(
              btfc_decode_rect(t.get(), nullptr, m, nullptr, r.x, r.y, static_cast<std::uint32_t>(r.w),
                               static_cast<std::uint32_t>(r.h), sample, rect.data(), stride, rect.size()),
              BTFC_OK);
          std::vector<std::int32_t> at;
          for (std::int32_t y = 0; y < r.h; ++y) {
            for (std::int32_t x = 0; x < r.w; ++x) at.insert(at.end(), {r.x + x, r.y + y});
          }
          Bytes texels(w * h * texel, 0xCD);
          ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, m, nullptr, at.data(), w * h, sample, texels.data(),
                                       texels.size()),
                    BTFC_OK);
          for (std::size_t y = 0; y < h; ++y) {
            ASSERT_TRUE(agree(&rect[y * stride], &texels[y * w * texel], w * info.channels, sample, error))
                << path << " map " << m << " sample " << sample << " row " << y;
            EXPECT_EQ(rect[y * stride + w * texel], 0xCD);  // nothing beside the row is written
          }
          if (sample != BTFC_FLOAT32) continue;
          std::vector<btfc_query> queries(w * h);
          for (std::size_t q = 0; q < queries.size(); ++q) {
            queries[q].x = at[2 * q];
            queries[q].y = at[2 * q + 1];
            queries[q].map = m;
          }
          std::vector<float> values(w * h * info.channels);
          ASSERT_EQ(btfc_eval(t.get(), nullptr, queries.data(), sizeof(btfc_query), queries.size(),
                              values.data(), info.channels),
                    BTFC_OK);
          Bytes answers(texels.size());
          std::memcpy(answers.data(), values.data(), answers.size());
          EXPECT_TRUE(agree(answers.data(), texels.data(), values.size(), sample, error)) << path;
        }
      }
    }
  }
}

// Texels anywhere, most of them far outside: clamped or wrapped as the file says, told by a second, plain
// reckoning. BTFC_QUERIES queries in all (default 1,000,000).
TEST_P(EveryModel, RandomTexelsOutside) {
  const char* wanted = std::getenv("BTFC_QUERIES");
  const auto paths = vectors_of(GetParam());
  if (stated_error(read_vector(paths.front())) != 0) return;  // nothing is outside of random fields
  const std::uint64_t total = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 1'000'000;
  constexpr std::size_t kBatch = 4096;
  std::mt19937_64 random(7);
  for (const auto& path : paths) {
    const Bytes file = read_vector(path);
    const TexturePtr t = load(file);
    const Result<OpenedFile> opened = open_bytes(file);
    ASSERT_TRUE(t && opened) << path;
    const std::int64_t size[2] = {btfc_texture_width(t.get()), btfc_texture_height(t.get())};
    const bool wraps = opened->head.wrap_u == Wrap::repeat;
    btfc_map_info info{};
    ASSERT_EQ(btfc_texture_map_info(t.get(), 0, &info), BTFC_OK);
    const std::size_t texel = info.channels * kSampleBytes[BTFC_FLOAT32];
    Bytes whole(static_cast<std::size_t>(size[0] * size[1]) * texel);
    ASSERT_EQ(btfc_decode_rect(t.get(), nullptr, 0, nullptr, 0, 0, static_cast<std::uint32_t>(size[0]),
                               static_cast<std::uint32_t>(size[1]), BTFC_FLOAT32, whole.data(),
                               static_cast<std::size_t>(size[0]) * texel, whole.size()),
              BTFC_OK);
    std::vector<std::int32_t> at(2 * kBatch);
    Bytes found(kBatch * texel);
    for (std::uint64_t done = 0; done < total / paths.size(); done += kBatch) {
      for (std::size_t i = 0; i < at.size(); ++i) {
        // Near and far: the number of bits is random too.
        at[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(random())) >> (random() % 32);
      }
      ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, 0, nullptr, at.data(), kBatch, BTFC_FLOAT32,
                                   found.data(), found.size()),
                BTFC_OK);
      for (std::size_t q = 0; q < kBatch; ++q) {
        std::int64_t inside[2];
        for (int axis = 0; axis < 2; ++axis) {
          const std::int64_t c = at[2 * q + static_cast<std::size_t>(axis)];
          inside[axis] = wraps ? ((c % size[axis]) + size[axis]) % size[axis]
                               : std::clamp<std::int64_t>(c, 0, size[axis] - 1);
        }
        const auto* expected =
            whole.data() + static_cast<std::size_t>(inside[1] * size[0] + inside[0]) * texel;
        ASSERT_EQ(std::memcmp(expected, &found[q * texel], texel), 0)
            << path << " at " << at[2 * q] << ", " << at[2 * q + 1];
      }
    }
  }
}

// An unbounded texture has texels everywhere: small rectangles near and far against their texels one by one,
// and with a period the same again one period on.
TEST_P(EveryModel, RandomRectanglesOfThePlane) {
  std::mt19937_64 random(11);
  for (const auto& path : vectors_of(GetParam())) {
    const Bytes file = read_vector(path);
    const double error = stated_error(file);
    if (error == 0) return;  // bounded
    btfc_reader* reader = nullptr;
    ASSERT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, nullptr), BTFC_OK);
    const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
    btfc_file_info head{};
    ASSERT_EQ(btfc_reader_info(reader, &head), BTFC_OK);
    // A multiple of everything that a period has to be a multiple of in these vectors.
    const std::uint32_t period = std::lcm(64u, std::lcm(head.width, head.height));
    for (const std::uint32_t wanted : {0u, period}) {
      btfc_selection selection{};
      selection.struct_size = sizeof selection;
      selection.period = wanted;
      btfc_texture* texture = nullptr;
      ASSERT_EQ(btfc_texture_load(reader, &selection, &texture, nullptr), BTFC_OK) << path;
      const TexturePtr t(texture);
      btfc_map_info info{};
      ASSERT_EQ(btfc_texture_map_info(t.get(), 0, &info), BTFC_OK);
      constexpr std::int32_t kSide = 3, kMost = std::numeric_limits<std::int32_t>::max() / 2;
      constexpr std::size_t kTexels = std::size_t{kSide} * kSide;
      const std::size_t samples = kTexels * info.channels;
      for (int round = 0; round < 6; ++round) {
        // Near and far: the number of bits is random too.
        std::int32_t corner[2];
        for (std::int32_t& c : corner)
          c = (static_cast<std::int32_t>(static_cast<std::uint32_t>(random())) >> (1 + random() % 30)) %
              kMost;
        std::vector<std::int32_t> at, later;
        for (std::int32_t y = 0; y < kSide; ++y) {
          for (std::int32_t x = 0; x < kSide; ++x) {
            at.insert(at.end(), {corner[0] + x, corner[1] + y});
            later.insert(later.end(), {corner[0] + x + static_cast<std::int32_t>(wanted), corner[1] + y});
          }
        }
        Bytes rect(samples * 4), texels(samples * 4), again(samples * 4);
        ASSERT_EQ(btfc_decode_rect(t.get(), nullptr, 0, nullptr, corner[0], corner[1], kSide, kSide,
                                   BTFC_FLOAT32, rect.data(), kSide * info.channels * 4, rect.size()),
                  BTFC_OK);
        ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, 0, nullptr, at.data(), kTexels, BTFC_FLOAT32,
                                     texels.data(), texels.size()),
                  BTFC_OK);
        ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, 0, nullptr, later.data(), kTexels, BTFC_FLOAT32,
                                     again.data(), again.size()),
                  BTFC_OK);
        EXPECT_TRUE(agree(rect.data(), texels.data(), samples, BTFC_FLOAT32, error))
            << path << " at " << corner[0] << ", " << corner[1] << " period " << wanted;
        EXPECT_EQ(texels, again) << path << " at " << corner[0] << ", " << corner[1] << " period " << wanted;
      }
    }
  }
}

TEST_P(EveryModel, ManyThreadsReadOneTexture) {
  const TexturePtr t = load(read_vector(vectors_of(GetParam()).front()));
  ASSERT_TRUE(t);
  const auto whole = [&] {
    std::vector<float> values(std::size_t{btfc_texture_width(t.get())} * btfc_texture_height(t.get()) * 4);
    btfc_decode_rect(t.get(), nullptr, 0, nullptr, 0, 0, btfc_texture_width(t.get()),
                     btfc_texture_height(t.get()), BTFC_FLOAT32, values.data(),
                     btfc_texture_width(t.get()) * 16, values.size() * 4);
    return values;
  };
  const std::vector<float> expected = whole();
  std::vector<std::thread> threads;
  std::vector<int> equal(8, 0);
  for (std::size_t i = 0; i < equal.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int round = 0; round < 20; ++round) equal[i] += whole() == expected ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const int count : equal) EXPECT_EQ(count, 20);
}

// Repacking keeps what is decoded: raw, zstd levels, alignments.
TEST_P(EveryModel, RepackingKeepsContents) {
  for (const auto& path : vectors_of(GetParam())) {
    const Bytes file = read_vector(path);
    const ByteView view(file);
    const Result<Directory> directory = read_directory(source_of(view));
    ASSERT_TRUE(directory);
    for (const PackOptions& options :
         {PackOptions{Codec::raw, 1, 4}, PackOptions{Codec::zstd, 1, 8}, PackOptions{Codec::zstd, 22, 4}}) {
      Result<std::vector<RawChunk>> chunks = read_all_chunks(source_of(view), *directory);
      ASSERT_TRUE(chunks);
      const Result<Bytes> packed = pack_file(*std::move(chunks), options);
      ASSERT_TRUE(packed);
      EXPECT_TRUE(verify_bytes(*packed)) << path;
      const std::vector<Image> a = decode(file), b = decode(*packed);
      for (std::size_t m = 0; m < a.size(); ++m) EXPECT_EQ(a[m].codes, b[m].codes);
    }
  }
}

struct CountingSource {
  const Bytes* file;
  std::vector<std::pair<std::uint64_t, std::size_t>> reads;
  static int read(void* user, std::uint64_t offset, void* destination, std::size_t size) {
    auto* self = static_cast<CountingSource*>(user);
    self->reads.emplace_back(offset, size);
    std::memcpy(destination, self->file->data() + offset, size);
    return 0;
  }
};

// Two reads for the directory, two for HEAD and PARM; then one a chunk.
TEST(PartialLoad, HeaderAndIndexThenSingleChunks) {
  const Bytes file = encode("patch", material("grain", 64, 64), {{"size", "256x256"}}, Codec::zstd);
  CountingSource counting{&file, {}};
  const btfc_source source{CountingSource::read, &counting, file.size()};
  btfc_reader* reader = nullptr;
  btfc_error error{};
  ASSERT_EQ(btfc_reader_open(&source, nullptr, &reader, &error), BTFC_OK) << error.message;
  ASSERT_EQ(counting.reads.size(), 4u);
  EXPECT_EQ(counting.reads[0], std::pair(std::uint64_t{0}, std::size_t{64}));
  std::size_t bytes = 0;
  for (const auto& [offset, size] : counting.reads) bytes += size;
  EXPECT_LT(bytes, 600u);

  btfc_file_info info{};
  ASSERT_EQ(btfc_reader_info(reader, &info), BTFC_OK);
  EXPECT_STREQ(info.model, "patch");
  EXPECT_EQ(info.width, 256u);
  EXPECT_EQ(info.file_bytes, file.size());
  counting.reads.clear();
  for (std::uint32_t i = 0; i < info.chunks; ++i) {
    btfc_chunk_info chunk{};
    ASSERT_EQ(btfc_reader_chunk_info(reader, i, &chunk), BTFC_OK);
    Bytes raw(chunk.raw_bytes);
    ASSERT_EQ(btfc_reader_read_chunk(reader, i, raw.data(), raw.size(), &error), BTFC_OK) << error.message;
    ASSERT_EQ(counting.reads.size(), i + 1u);
    EXPECT_EQ(counting.reads.back(), std::pair(chunk.offset, static_cast<std::size_t>(chunk.stored_bytes)));
  }
  btfc_reader_free(reader);
}

TEST(PartialLoad, FailingReadsAreErrors) {  // eight reads: directory 2, HEAD, PARM, four arrays
  const Bytes file = encode("patch", noise(16, 16, 3, SampleType::unorm8), {{"k", "2"}, {"we", "2"}});
  struct Failing {
    const Bytes* file;
    int left;
  };
  for (int allowed = 0; allowed < 9; ++allowed) {
    Failing failing{&file, allowed};
    const btfc_source source{[](void* user, std::uint64_t offset, void* to, std::size_t size) {
                               auto* f = static_cast<Failing*>(user);
                               if (f->left-- == 0) return 1;
                               std::memcpy(to, f->file->data() + offset, size);
                               return 0;
                             },
                             &failing, file.size()};
    btfc_reader* reader = nullptr;
    btfc_texture* texture = nullptr;
    btfc_error error{};
    btfc_result result = btfc_reader_open(&source, nullptr, &reader, &error);
    if (result == BTFC_OK) result = btfc_texture_load(reader, nullptr, &texture, &error);
    EXPECT_EQ(result, allowed < 8 ? BTFC_IO : BTFC_OK) << allowed;
    btfc_texture_free(texture);
    btfc_reader_free(reader);
  }
}

// spec/btfc.md section 6.
TEST(Conversions, FollowTheSpec) {
  const Image bytes = noise(16, 16, 1, SampleType::unorm8), words = noise(64, 64, 1, SampleType::unorm16),
              halves = noise(64, 64, 1, SampleType::float16);
  const auto decoded = [](const Image& image, btfc_sample sample) {
    // One patch as large as the sample: the texture is the sample.
    const Bytes file = encode("patch", image, {{"k", "1"}, {"we", "0"}, {"wb", std::to_string(image.width)}});
    const TexturePtr t = load(file);
    Bytes out(image.codes.size() * kSampleBytes[sample]);
    btfc_decode_rect(t.get(), nullptr, 0, nullptr, 0, 0, image.width, image.height, sample, out.data(),
                     image.width * kSampleBytes[sample], out.size());
    return out;
  };
  const auto float_at = [](const Bytes& out, std::size_t i) {
    float value;
    std::memcpy(&value, &out[4 * i], 4);
    return value;
  };
  const Bytes byte_float = decoded(bytes, BTFC_FLOAT32), byte_word = decoded(bytes, BTFC_UNORM16),
              byte_half = decoded(bytes, BTFC_FLOAT16);
  for (std::size_t i = 0; i < bytes.codes.size(); ++i) {
    EXPECT_EQ(float_at(byte_float, i), static_cast<float>(bytes.codes[i]) / 255.0f);
    EXPECT_EQ(load_u16(&byte_word[2 * i]), 257u * bytes.codes[i]);
    EXPECT_EQ(load_u16(&byte_half[2 * i]), btfc_float_to_half(static_cast<float>(bytes.codes[i]) / 255.0f));
  }
  const Bytes word_byte = decoded(words, BTFC_UNORM8), word_float = decoded(words, BTFC_FLOAT32);
  for (std::size_t i = 0; i < words.codes.size(); ++i) {
    EXPECT_EQ(word_byte[i], (255u * words.codes[i] + 32767u) / 65535u);
    EXPECT_EQ(float_at(word_float, i), static_cast<float>(words.codes[i]) / 65535.0f);
  }
  const Bytes half_byte = decoded(halves, BTFC_UNORM8), half_float = decoded(halves, BTFC_FLOAT32),
              half_same = decoded(halves, BTFC_FLOAT16);
  for (std::size_t i = 0; i < halves.codes.size(); ++i) {
    const float value = btfc_half_to_float(halves.codes[i]);
    EXPECT_EQ(float_at(half_float, i), value);
    EXPECT_EQ(half_byte[i], static_cast<int>(std::min(std::max(value, 0.0f), 1.0f) * 255.0f + 0.5f));
    EXPECT_EQ(load_u16(&half_same[2 * i]), halves.codes[i]);
  }
}

// Words and parameters written for a GPU, read by the shared header, give what the decoder gives.
TEST(GpuData, WordsAndParamsAreEnough) {
  for (const auto& path : vectors_of("patch")) {
    const Bytes file = read_vector(path);
    const TexturePtr t = load(file);
    ASSERT_TRUE(t);
    std::vector<std::vector<std::uint32_t>> slots(BTFC_WORD_SLOTS);
    BtfcWords words{};
    for (std::uint32_t s = 0; s < BTFC_WORD_SLOTS; ++s) {
      slots[s].resize(btfc_gpu_words_size(t.get(), s) / 4);
      ASSERT_EQ(btfc_gpu_write_words(t.get(), s, slots[s].data(), 4 * slots[s].size()), BTFC_OK);
      words.slot[s] = slots[s].data();
    }
    ASSERT_EQ(btfc_gpu_planes(t.get()), btfc_texture_maps(t.get()));
    for (std::uint32_t m = 0; m < btfc_texture_maps(t.get()); ++m) {
      PatchParams params{};
      ASSERT_EQ(btfc_gpu_params_size(t.get(), m), sizeof params);
      ASSERT_EQ(btfc_gpu_write_params(t.get(), m, &params, sizeof params), BTFC_OK);
      btfc_plane_info plane{};
      ASSERT_EQ(btfc_gpu_plane_info(t.get(), m, &plane), BTFC_OK);
      EXPECT_EQ(plane.first_word, params.plane_word);
      const Image image = *decode_map(t.get(), m);
      for (std::uint32_t y = 0; y < image.height; ++y) {
        for (std::uint32_t x = 0; x < image.width; ++x) {
          const uvec4 codes = patch_codes(words, params, x, y);
          for (std::uint32_t c = 0; c < image.channels; ++c)
            ASSERT_EQ(codes[static_cast<int>(c)], image.at(x, y, c)) << path << x << ' ' << y;
        }
      }
    }
  }
}

#ifdef NDEBUG  // debug builds stop at caller errors, as btfc.h says
TEST(CallerErrors, AreResultsAndChangeNothing) {
  const Bytes file = encode("patch", noise(16, 16, 3, SampleType::unorm8), {{"k", "2"}});
  const TexturePtr t = load(file);
  ASSERT_TRUE(t);
  Bytes out(100, 0xCD);
  const auto rect = [&](std::uint32_t map, std::uint32_t w, std::uint32_t h, btfc_sample sample,
                        std::size_t stride, std::size_t size) {
    return btfc_decode_rect(t.get(), nullptr, map, nullptr, 0, 0, w, h, sample, out.data(), stride, size);
  };
  EXPECT_EQ(rect(1, 2, 2, BTFC_UNORM8, 6, 12), BTFC_BAD_ARGUMENT);
  EXPECT_EQ(rect(0, 2, 2, BTFC_UNORM8, 5, 12), BTFC_BAD_ARGUMENT);
  EXPECT_EQ(rect(0, 2, 2, BTFC_UNORM8, 6, 11), BTFC_BAD_ARGUMENT);
  EXPECT_EQ(rect(0, 2, 0xffffffff, BTFC_UNORM8, 6, 12), BTFC_BAD_ARGUMENT);
  EXPECT_EQ(rect(0, 2, 2, BTFC_UNORM8, std::numeric_limits<std::size_t>::max(), 12), BTFC_BAD_ARGUMENT);
  EXPECT_EQ(btfc_decode_rect(t.get(), nullptr, 0, nullptr, INT32_MAX, 0, 2, 1, BTFC_UNORM8, out.data(), 6, 6),
            BTFC_BAD_ARGUMENT);
  EXPECT_EQ(rect(0, 0, 2, BTFC_UNORM8, 0, 0), BTFC_OK);
  const std::int32_t at[2] = {0, 0};
  EXPECT_EQ(btfc_decode_texels(t.get(), nullptr, 0, nullptr, at, std::numeric_limits<std::size_t>::max(),
                               BTFC_UNORM8, out.data(), 3),
            BTFC_BAD_ARGUMENT);
  EXPECT_EQ(btfc_decode_texels(nullptr, nullptr, 0, nullptr, at, 1, BTFC_UNORM8, out.data(), 3),
            BTFC_BAD_ARGUMENT);
  EXPECT_EQ(out, Bytes(100, 0xCD));
  EXPECT_EQ(btfc_reader_open_memory(nullptr, 5, nullptr, nullptr, nullptr), BTFC_BAD_ARGUMENT);
  btfc_options options{};
  btfc_reader* reader = nullptr;
  EXPECT_EQ(btfc_reader_open_memory(file.data(), file.size(), &options, &reader, nullptr), BTFC_BAD_ARGUMENT);
}
#endif

TEST(Wrapper, LoadsAndReads) {
  const Image image = noise(16, 16, 3, SampleType::unorm8);
  const Texture t = Texture::load(encode("patch", image, {{"k", "1"}, {"we", "0"}, {"wb", "16"}}));
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_EQ(t.width(), 16u);
  EXPECT_STREQ(t.map(0).name, "image");
  EXPECT_EQ(t.texel(3, 4).channel[1], static_cast<float>(image.at(3, 4, 1)) / 255.0f);
  EXPECT_FALSE(Texture::load({}));
}

}  // namespace
}  // namespace btfc::test
