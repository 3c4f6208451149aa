// btfc_demo OUT_DIR: four procedural materials through encoder and decoder; prints a table, writes a picture
// and the files.
#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>

#include "encoder/image_file.h"
#include "encoder/model_table.h"
#include "encoder/output/atomic_file.h"
#include "encoder/synth/texture_synth.h"
#include "format/container.h"
#include "tools/exit_code.h"
#include "tools/texture_file.h"

namespace {

using namespace btfc;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kSample = 128, kTexture = 1024, kShown = 256, kInset = 96, kGap = 4;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// A column of the picture: the texture's top left part, the sample's middle framed in its corner.
void show(Image& sheet, std::uint32_t column, const Image& texture, const Image& sample) {
  const std::uint32_t left = column * (kShown + kGap);
  for (std::uint32_t y = 0; y < kShown; ++y) {
    for (std::uint32_t x = 0; x < kShown; ++x) {
      const bool inset = x < kInset && y < kInset, frame = x < kInset + 3 && y < kInset + 3 && !inset;
      for (std::uint32_t c = 0; c < 3; ++c) {
        sheet.at(left + x, y, c) = frame   ? std::uint16_t{255}
                                   : inset ? sample.at(x + 16, y + 16, c)
                                           : texture.at(x, y, c);
      }
    }
  }
}

Result<Done> run(const std::string& out) {
  mkdir(out.c_str(), 0777);
  Image sheet;
  sheet.width = 4 * kShown + 3 * kGap;
  sheet.height = kShown;
  sheet.channels = 3;
  sheet.codes.assign(std::size_t{sheet.width} * sheet.height * 3, 255);
  fmt::print(
      "Sample {0}x{0}, texture {1}x{1}, 8-bit RGB, tau 0.1. Bits per texel by formula and as a file with "
      "zstd; ratio "
      "to the "
      "uncompressed texture.\n\n",
      kSample, kTexture);
  fmt::print(
      "| texture | class | blend | bits per texel | file | ratio | encode s | decode Mtexel/s | decoded = "
      "synthesised |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  bool exact = true;
  std::uint32_t column = 0;
  for (const TextureKind& kind : texture_kinds()) {
    TextureOptions texture_options;
    texture_options.width = texture_options.height = kSample;
    const Result<Image> sample = synthesize_texture(kind.name, texture_options);
    if (!sample) return sample.error();
    for (const char* blend : {"quilting", "liang"}) {
      FitSettings settings;
      settings.options = {{"size", fmt::format("{0}x{0}", kTexture)},
                          {"blend", blend},
                          {"tau", "0.1"},
                          {"synthesized", "kept in memory"}};
      const auto begin = Clock::now();
      Result<FitResult> fit = fitter(ModelId::patch).fit({{{"image", *sample}}}, settings);
      if (!fit) return fit.error();
      const Result<Bytes> file = pack_file(fit->chunks);
      if (!file) return file.error();
      const double encode_seconds = seconds_since(begin);
      const std::string path = fmt::format("{}/{}-{}.btfc", out, kind.name, blend);
      if (const auto wrote = write_file(path, *file); !wrote) return wrote.error();

      const Result<TexturePtr> texture = load_texture(path);
      if (!texture) return texture.error();
      Bytes rgb(std::size_t{kTexture} * kTexture * 3);
      int rounds = 0;
      const auto decode_begin = Clock::now();
      do {
        btfc_decode_rect(texture->get(), nullptr, 0, nullptr, 0, 0, kTexture, kTexture, BTFC_UNORM8,
                         rgb.data(), kTexture * 3, rgb.size());
        ++rounds;
      } while (seconds_since(decode_begin) < 0.1);
      const double rate = rounds * double{kTexture} * kTexture / seconds_since(decode_begin) / 1e6;

      const Result<Image> decoded = decode_map(texture->get(), 0);
      if (!decoded) return decoded.error();
      const bool same = decoded->codes == fit->side_images[0].image.codes;
      exact = exact && same;
      std::uint64_t payload = 0;
      for (const RawChunk& chunk : fit->chunks) payload += chunk.key.flags & kPayload ? chunk.raw.size() : 0;
      const double texels = double{kTexture} * kTexture;
      fmt::print("| {} | {} | {} | {:.3f} | {:.3f} | 1:{:.0f} | {:.2f} | {:.0f} | {} |\n", kind.name,
                 kind.texture_class, blend, 8.0 * static_cast<double>(payload) / texels,
                 8.0 * static_cast<double>(file->size()) / texels, 3 * texels / static_cast<double>(payload),
                 encode_seconds, rate, same ? "yes" : "NO");
      if (std::string(blend) == "quilting" && column < 4) show(sheet, column++, *decoded, *sample);
    }
  }
  const std::string picture = out + "/demo.png";
  if (const auto wrote = write_image(picture, sheet); !wrote) return wrote.error();
  fmt::print("\n{}: the decoded textures, each with the middle of its sample in the corner\n", picture);
  if (!exact) return Error{Status::invalid_file, "a decoded texture is not the synthesised one", "", 0};
  return Done{};
}

}  // namespace

int main(int argc, char** argv) {
  const Result<Done> done = run(argc > 1 ? argv[1] : "demo");
  return done ? kExitOk : fail("demo", done.error());
}
