// Implementation of the tests' shared parts.
#include "tests/test_support.h"

#include <algorithm>
#include <bit>

#include "encoder/output/atomic_file.h"
#include "encoder/synth/texture_synth.h"
#include "format/checked.h"
#include "format/chunk_codec.h"

namespace btfc::test {
namespace {

std::uint64_t next_random(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

void store_directory(Bytes& file, const Parts& parts) {
  store_u32(&file[24], static_cast<std::uint32_t>(parts.entries.size()));
  store_u64(&file[32], file.size());
  std::uint64_t payload = 0;
  for (std::size_t i = 0; i < parts.entries.size(); ++i) {
    const IndexEntry& e = parts.entries[i];
    std::uint8_t* p = &file[kHeaderBytes + kIndexEntryBytes * i];
    store_u32(p, e.key.type);
    store_u16(p + 4, e.key.flags);
    store_u16(p + 6, static_cast<std::uint16_t>(e.codec));
    store_u64(p + 8, e.offset);
    store_u64(p + 16, e.stored_bytes);
    store_u64(p + 24, e.raw_bytes);
    store_u64(p + 32, e.raw_hash);
    store_u32(p + 40, e.key.key_a());
    store_u32(p + 44, e.key.tile);
    if (e.key.flags & kPayload) payload += e.raw_bytes;
  }
  store_u64(&file[40], payload);
}

void store_directory_hash(Bytes& file, std::size_t entries) {
  Bytes hashed(file.begin(), file.begin() + 56);
  hashed.insert(hashed.end(), file.begin() + kHeaderBytes,
                file.begin() + static_cast<std::ptrdiff_t>(kHeaderBytes + kIndexEntryBytes * entries));
  store_u64(&file[56], content_hash(hashed));
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

ByteSource source_of(const ByteView& bytes) { return memory_source(&bytes); }

Result<OpenedFile> open_bytes(const Bytes& file) {
  const ByteView view(file);
  return open_file(source_of(view));
}

Result<Done> verify_bytes(const Bytes& file) {
  const ByteView view(file);
  return verify_file(source_of(view));
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

void repair_hashes(Bytes& file) {
  if (file.size() < kHeaderBytes) return;
  const std::uint64_t count = load_u32(&file[24]);
  if (kHeaderBytes + kIndexEntryBytes * count > file.size()) return;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint8_t* p = &file[kHeaderBytes + kIndexEntryBytes * i];
    const std::uint64_t offset = load_u64(p + 8), stored = load_u64(p + 16), raw_bytes = load_u64(p + 24);
    if (offset > file.size() || stored > file.size() - offset || raw_bytes > kMaxChunkBytes) continue;
    const unsigned codec = load_u16(p + 6);
    if (codec > 1) continue;
    const Result<Bytes> raw =
        decode_chunk({file.data() + offset, stored}, static_cast<Codec>(codec), raw_bytes);
    if (raw) store_u64(p + 32, content_hash(*raw));
  }
  store_directory_hash(file, count);
}

Parts take_apart(const Bytes& file) {
  Parts parts;
  const ByteView view(file);
  Result<Directory> directory = read_directory(source_of(view));
  if (!directory) {
    ADD_FAILURE() << directory.error().message;
    return parts;
  }
  parts.header = directory->header;
  parts.entries = directory->entries;
  for (const IndexEntry& e : parts.entries) {
    const auto from = file.begin() + static_cast<std::ptrdiff_t>(e.offset);
    parts.stored.emplace_back(from, from + static_cast<std::ptrdiff_t>(e.stored_bytes));
  }
  return parts;
}

Bytes put_together(const Parts& parts) {
  Parts p = parts;
  std::uint64_t end = kHeaderBytes + kIndexEntryBytes * p.entries.size();
  for (std::size_t i = 0; i < p.entries.size(); ++i) {
    IndexEntry& e = p.entries[i];
    e.offset = align_up(end, p.header.align_log2).value();
    e.stored_bytes = p.stored[i].size();
    if (e.codec == Codec::raw) {
      e.raw_bytes = e.stored_bytes;
      e.raw_hash = content_hash(p.stored[i]);
    }
    end = e.offset + e.stored_bytes;
  }
  Bytes file(end);
  std::copy(kMagic.begin(), kMagic.end(), file.begin());
  store_u16(&file[12], kVersionMajor);
  store_u16(&file[14], kVersionMinor);
  store_u32(&file[16], p.header.incompatible_features);
  store_u32(&file[20], p.header.compatible_features);
  store_u32(&file[28], p.header.align_log2);
  store_directory(file, p);
  for (std::size_t i = 0; i < p.entries.size(); ++i) {
    std::copy(p.stored[i].begin(), p.stored[i].end(),
              file.begin() + static_cast<std::ptrdiff_t>(p.entries[i].offset));
  }
  store_directory_hash(file, p.entries.size());
  return file;
}

}  // namespace btfc::test
