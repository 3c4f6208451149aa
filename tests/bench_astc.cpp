// btfc_bench_astc: decode rates of a patch texture beside astcenc on the same picture, in one process.
//
// btfc_bench_astc IN.btfc [SECONDS]     (8-bit RGB, one thread; run by hand, times are never judged by a
// test)
#include <astcenc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <random>

#include "tools/texture_file.h"

namespace btfc::test {
namespace {

constexpr std::size_t kRandomTexels = 200000;
constexpr int kRounds = 9;

struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

struct ContextFree {
  void operator()(astcenc_context* context) const { astcenc_context_free(context); }
};

constexpr astcenc_swizzle kSwizzle = {ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_A};

// A picture in one ASTC block size: made with preset medium, then only read.
class Astc {
 public:
  bool compress(const Picture& picture, unsigned side) {
    side_ = side;
    width_ = picture.width;
    height_ = picture.height;
    blocks_x_ = (width_ + side - 1) / side;
    data_.resize(std::size_t{16} * blocks_x_ * ((height_ + side - 1) / side));
    std::vector<std::uint8_t> rgba(std::size_t{4} * width_ * height_, 255);
    for (std::size_t i = 0; i < rgba.size() / 4; ++i) std::copy_n(&picture.rgb[3 * i], 3, &rgba[4 * i]);
    const auto encoder = context(ASTCENC_PRE_MEDIUM, 0);
    void* slice = rgba.data();
    astcenc_image image = {width_, height_, 1, ASTCENC_TYPE_U8, &slice};
    if (!encoder ||
        astcenc_compress_image(encoder.get(), &image, &kSwizzle, data_.data(), data_.size(), 0) != 0)
      return false;
    decoder_ = context(ASTCENC_PRE_MEDIUM, ASTCENC_FLG_DECOMPRESS_ONLY);
    whole_.resize(rgba.size());
    return decoder_ != nullptr && decode();
  }

  // All of it, RGBA, into a buffer of its own.
  bool decode() {
    void* slice = whole_.data();
    astcenc_image image = {width_, height_, 1, ASTCENC_TYPE_U8, &slice};
    return astcenc_decompress_image(decoder_.get(), data_.data(), data_.size(), &image, &kSwizzle, 0) == 0;
  }

  // One texel: the public interface decodes images, so this is an image of the one block that holds it.
  void texel(std::uint32_t x, std::uint32_t y, std::uint8_t* rgb) {
    std::uint8_t block[12 * 12 * 4];
    void* slice = block;
    astcenc_image image = {side_, side_, 1, ASTCENC_TYPE_U8, &slice};
    const std::size_t number = std::size_t{y / side_} * blocks_x_ + x / side_;
    astcenc_decompress_image(decoder_.get(), &data_[16 * number], 16, &image, &kSwizzle, 0);
    std::memcpy(rgb, block + std::size_t{4} * (y % side_ * side_ + x % side_), 3);
  }

  const std::vector<std::uint8_t>& whole() const { return whole_; }
  double bits_per_texel() const { return 8.0 * static_cast<double>(data_.size()) / (1.0 * width_ * height_); }
  unsigned side() const { return side_; }
  double psnr(const Picture& picture) const {
    double sum = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
      const int d = picture.rgb[i] - whole_[i / 3 * 4 + i % 3];
      sum += d * d;
    }
    return 10 * std::log10(255.0 * 255.0 * static_cast<double>(picture.rgb.size()) / sum);
  }

 private:
  std::unique_ptr<astcenc_context, ContextFree> context(float quality, unsigned flags) const {
    astcenc_config config{};
    astcenc_context* made = nullptr;
    const astcenc_error e = astcenc_config_init(ASTCENC_PRF_LDR, side_, side_, 1, quality, flags, &config);
    if (e != ASTCENC_SUCCESS || astcenc_context_alloc(&config, 1, &made) != ASTCENC_SUCCESS)
      std::fprintf(stderr, "astcenc: %s\n", astcenc_get_error_string(e));
    return std::unique_ptr<astcenc_context, ContextFree>(made);
  }

  unsigned side_ = 0;
  std::uint32_t width_ = 0, height_ = 0, blocks_x_ = 0;
  std::vector<std::uint8_t> data_, whole_;
  std::unique_ptr<astcenc_context, ContextFree> decoder_;
};

struct Contestant {
  std::string name;
  std::size_t texels;
  std::function<void()> work;
  std::vector<double> rates;

  double median() const {
    std::vector<double> sorted = rates;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
  double spread() const {
    const auto [least, most] = std::minmax_element(rates.begin(), rates.end());
    return (*most - *least) / median();
  }
};

// Contestants take turns, and each ratio is taken inside its round, so that a disturbance meets both sides.
void measure(std::vector<Contestant>& all, double seconds) {
  using Clock = std::chrono::steady_clock;
  for (Contestant& one : all) one.work();
  for (int round = 0; round < kRounds; ++round) {
    for (Contestant& one : all) {
      std::size_t runs = 0;
      double spent = 0;
      const auto begin = Clock::now();
      do {
        one.work();
        ++runs;
        spent = std::chrono::duration<double>(Clock::now() - begin).count();
      } while (spent < seconds / kRounds);
      one.rates.push_back(static_cast<double>(runs * one.texels) / spent);
    }
  }
}

double ratio(const Contestant& a, const Contestant& b) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < a.rates.size(); ++i) ratios.push_back(a.rates[i] / b.rates[i]);
  std::sort(ratios.begin(), ratios.end());
  return ratios[ratios.size() / 2];
}

// The first contestant is btfc's; ratios are its rate over the others'.
void table(const char* title, const std::vector<Contestant>& all) {
  std::printf("\n%-34s %12s %8s %16s\n", title, "Mtexel/s", "spread", "btfc / this");
  for (const Contestant& one : all)
    std::printf("%-34s %12.3f %7.0f%% %16.3f\n", one.name.c_str(), one.median() / 1e6, 100 * one.spread(),
                ratio(all.front(), one));
}

int run(const char* path, double seconds) {
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) {
    std::fprintf(stderr, "btfc_bench_astc: %s\n", texture.error().message.c_str());
    return 1;
  }
  const btfc_texture* t = texture->get();
  btfc_map_info info{};
  btfc_texture_map_info(t, 0, &info);
  if (info.channels != 3 || info.sample != BTFC_UNORM8) {
    std::fprintf(stderr, "btfc_bench_astc: the first map is not 8-bit RGB\n");
    return 1;
  }
  Picture picture = {btfc_texture_width(t), btfc_texture_height(t), {}};
  const std::size_t row = std::size_t{3} * picture.width, size = row * picture.height;
  const std::size_t texels = std::size_t{picture.width} * picture.height;
  picture.rgb.resize(size);
  const auto decode = [&](std::vector<std::uint8_t>& to) {
    btfc_decode_rect(t, nullptr, 0, nullptr, 0, 0, picture.width, picture.height, BTFC_UNORM8, to.data(), row,
                     size);
  };
  decode(picture.rgb);

  std::printf("%s: %ux%u RGB8, one thread, %d rounds in turn\n", path, picture.width, picture.height,
              kRounds);
  std::printf(
      "astcenc %s, a distribution's library: its interface does not tell the instruction set; without\n"
      "dispatch at run time it is the architecture's baseline (x86-64: SSE2), an AVX2 build is faster\n",
      BTFC_ASTCENC_VERSION);
  Astc astc6, astc12;
  if (!astc6.compress(picture, 6) || !astc12.compress(picture, 12)) {
    std::fprintf(stderr, "btfc_bench_astc: astcenc refused the picture\n");
    return 1;
  }
  std::uint64_t memory_bits = 0;
  for (std::uint32_t slot = 0; slot < BTFC_WORD_SLOTS; ++slot)
    memory_bits += 8 * btfc_gpu_words_size(t, slot);
  std::printf("\n%-34s %16s %12s\n", "against the synthesised picture", "bits per texel", "PSNR dB");
  std::printf("%-34s %16.4f %12s\n", "btfc, words (GPU; CPU: + a sample)",
              static_cast<double>(memory_bits) / static_cast<double>(texels), "exact");
  for (const Astc* astc : {&astc6, &astc12})
    std::printf("astc %2ux%-2u medium %16s %16.4f %12.2f\n", astc->side(), astc->side(), "",
                astc->bits_per_texel(), astc->psnr(picture));

  std::vector<std::uint8_t> other(size);
  std::vector<Contestant> full = {
      {"btfc_decode_rect, RGB8", texels, [&] { decode(other); }, {}},
      {"memcpy of the same bytes", texels, [&] { std::memcpy(other.data(), picture.rgb.data(), size); }, {}},
      {"astcenc 6x6, RGBA8", texels, [&] { astc6.decode(); }, {}},
      {"astcenc 12x12, RGBA8", texels, [&] { astc12.decode(); }, {}}};
  measure(full, seconds);
  table("whole picture", full);

  std::mt19937 random(1);
  std::vector<std::int32_t> at(2 * kRandomTexels);
  for (std::size_t i = 0; i < kRandomTexels; ++i) {
    at[2 * i] = static_cast<std::int32_t>(random() % picture.width);
    at[2 * i + 1] = static_cast<std::int32_t>(random() % picture.height);
  }
  std::vector<std::uint8_t> out(3 * kRandomTexels), expected(3 * kRandomTexels);
  const auto singles = [&] {
    for (std::size_t i = 0; i < kRandomTexels; ++i)
      btfc_decode_texels(t, nullptr, 0, nullptr, &at[2 * i], 1, BTFC_UNORM8, &out[3 * i], 3);
  };
  const auto batch = [&] {
    btfc_decode_texels(t, nullptr, 0, nullptr, at.data(), kRandomTexels, BTFC_UNORM8, out.data(), out.size());
  };
  const auto raw = [&] {
    for (std::size_t i = 0; i < kRandomTexels; ++i)
      std::memcpy(
          &out[3 * i],
          &picture
               .rgb[static_cast<std::size_t>(at[2 * i + 1]) * row + 3 * static_cast<std::size_t>(at[2 * i])],
          3);
  };
  // A tenth of the texels: a block each is slow.
  const auto blocks = [&](Astc& astc) {
    for (std::size_t i = 0; i < kRandomTexels / 10; ++i)
      astc.texel(static_cast<std::uint32_t>(at[2 * i]), static_cast<std::uint32_t>(at[2 * i + 1]),
                 &out[3 * i]);
  };
  raw();
  expected = out;
  for (const std::function<void()>& work : {std::function<void()>(singles), std::function<void()>(batch)}) {
    std::fill(out.begin(), out.end(), std::uint8_t{0xaa});
    work();
    if (out != expected) {
      std::fprintf(stderr, "btfc_bench_astc: random texels differ from the rectangle's\n");
      return 1;
    }
  }
  // The whole decode's block must be the single block, or the two rates are of different things.
  for (Astc* astc : {&astc6, &astc12}) {
    for (std::size_t i = 0; i < 1000; ++i) {
      const auto x = static_cast<std::uint32_t>(at[2 * i]), y = static_cast<std::uint32_t>(at[2 * i + 1]);
      std::uint8_t rgb[3];
      astc->texel(x, y, rgb);
      if (std::memcmp(rgb, &astc->whole()[4 * (std::size_t{y} * picture.width + x)], 3) != 0) {
        std::fprintf(stderr, "btfc_bench_astc: a single ASTC block differs from the whole decode\n");
        return 1;
      }
    }
  }
  std::vector<Contestant> singly = {
      {"btfc_decode_texels, count 1", kRandomTexels, singles, {}},
      {"btfc_decode_texels, one batch", kRandomTexels, batch, {}},
      {"3 bytes of the raw picture", kRandomTexels, raw, {}},
      {"astcenc 6x6, a block a texel", kRandomTexels / 10, [&] { blocks(astc6); }, {}},
      {"astcenc 12x12, a block a texel", kRandomTexels / 10, [&] { blocks(astc12); }, {}}};
  measure(singly, seconds);
  table("random texels", singly);
  std::printf(
      "(\"a block a texel\" is a call of astcenc's for an image of one block, its context made once; without "
      "the\n"
      "call, at the whole picture's rate: 6x6 %.3f, 12x12 %.3f Mtexel/s)\n",
      full[2].median() / 36e6, full[3].median() / 144e6);
  return 0;
}

}  // namespace
}  // namespace btfc::test

int main(int argc, char** argv) {
  const double seconds = argc > 2 ? std::atof(argv[2]) : 2.0;
  if (argc < 2 || argc > 3 || !(seconds > 0)) {
    std::fprintf(stderr, "usage: btfc_bench_astc IN.btfc [SECONDS]\n");
    return 1;
  }
  return btfc::test::run(argv[1], seconds);
}
