// Implementation of the tests' shared parts.
#include "tests/test_support.h"

#include <algorithm>
#include <bit>

#include "encoder/output/atomic_file.h"
#include "encoder/synth/texture_synth.h"

namespace btfc::test {
namespace {

std::uint64_t next_random(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

}  // namespace

Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
            std::uint64_t seed) {
  Image image = constant(width, height, channels, type, 0);
  std::uint64_t state = seed;
  for (std::uint16_t& code : image.codes) {
    const std::uint64_t bits = next_random(state);
    code = static_cast<std::uint16_t>(type == SampleType::unorm8 ? bits & 0xff : bits & 0xffff);
    if (type == SampleType::float16 && (code & 0x7c00) == 0x7c00)
      code = bits >> 40 & 1 ? 0x7bff : code & 0x83ff;
  }
  return image;
}

Image constant(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
               std::uint16_t code) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.type = type;
  image.codes.assign(std::size_t{width} * height * channels, code);
  return image;
}

Image material(const char* kind, std::uint32_t width, std::uint32_t height, SampleType type) {
  TextureOptions options;
  options.width = width;
  options.height = height;
  options.type = type;
  Result<Image> image = synthesize_texture(kind, options);
  if (!image) {
    ADD_FAILURE() << image.error().message;
    return constant(width, height, 3, type, 0);
  }
  return *std::move(image);
}

FitResult fit(const char* model, const Image& image, const OptionValues& options, unsigned threads) {
  FitSettings settings;
  settings.options = options;
  settings.threads = threads;
  Result<FitResult> result = fitter(find_model(model)->id).fit({{{"image", image}}}, settings);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  return *std::move(result);
}

Bytes pack(const FitResult& result, Codec codec) {
  PackOptions options;
  options.codec = codec;
  Result<Bytes> file = pack_file(result.chunks, options);
  if (!file) {
    ADD_FAILURE() << file.error().message;
    return {};
  }
  return *std::move(file);
}

Bytes encode(const char* model, const Image& image, const OptionValues& options, Codec codec,
             unsigned threads) {
  return pack(fit(model, image, options, threads), codec);
}

std::vector<std::filesystem::path> vectors_of(const char* model) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(BTFC_VECTORS) / model)) {
    if (entry.path().extension() == ".btfc") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

double stated_error(const Bytes& file) {
  const Result<OpenedFile> opened = open_bytes(file);
  if (!opened || !opened->head.unbounded || opened->parm.size() < 20) return 0;
  return std::bit_cast<float>(load_u32(&opened->parm[16]));
}

TexturePtr load(const Bytes& file, btfc_error* error) {
  btfc_reader* reader = nullptr;
  if (btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, error) != BTFC_OK) return nullptr;
  const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
  btfc_texture* texture = nullptr;
  if (btfc_texture_load(reader, nullptr, &texture, error) != BTFC_OK) return nullptr;
  return TexturePtr(texture);
}

std::vector<Image> decode(const Bytes& file) {
  std::vector<Image> maps;
  btfc_error error{};
  const TexturePtr texture = load(file, &error);
  if (!texture) {
    ADD_FAILURE() << error.message;
    return maps;
  }
  for (std::uint32_t m = 0; m < btfc_texture_maps(texture.get()); ++m) {
    Result<Image> image = decode_map(texture.get(), m);
    if (image) maps.push_back(*std::move(image));
  }
  return maps;
}

}  // namespace btfc::test
