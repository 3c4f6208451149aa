// Glue between files, the C interface and images.
#include "tools/texture_file.h"

#include <fmt/format.h>

#include "format/container.h"
#include "tools/file_source.h"

namespace btfc {

Error from_api(const btfc_error& error) {
  constexpr Status kStatus[] = {Status::ok,           Status::bad_argument,  Status::io,
                                Status::invalid_file, Status::out_of_memory, Status::limit,
                                Status::unsupported};
  const std::string rule = error.rule[0] != '\0' ? fmt::format(" [{}]", error.rule) : "";
  return {kStatus[error.result], error.message + rule, "", error.offset};
}

namespace {

using ReaderPtr = std::unique_ptr<btfc_reader, ReaderFree>;

Result<ReaderPtr> open_in_memory(ByteView file) {
  btfc_error error{};
  btfc_reader* reader = nullptr;
  if (btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, &error) != BTFC_OK)
    return from_api(error);
  return ReaderPtr(reader);
}

// Calls use(reader) over a file on disk; use reports into its btfc_error.
template <class Use>
Result<Done> with_reader(const std::string& path, const Use& use) {
  const Result<FileSource> file = FileSource::open(path);
  if (!file) return file.error();
  const ByteSource bytes = file->source();
  btfc_source source{};
  source.user = const_cast<ByteSource*>(&bytes);
  source.size = bytes.size;
  source.read = [](void* user, uint64_t offset, void* destination, size_t size) {
    const auto* s = static_cast<const ByteSource*>(user);
    return s->read(s->user, offset, destination, size) ? 0 : 1;
  };
  btfc_error error{};
  btfc_reader* reader = nullptr;
  if (btfc_reader_open(&source, nullptr, &reader, &error) != BTFC_OK) return placed(path, from_api(error));
  const ReaderPtr owned(reader);
  if (use(reader, &error) != BTFC_OK) return placed(path, from_api(error));
  return Done{};
}

}  // namespace

Result<TexturePtr> load_texture(const std::string& path, const btfc_selection* selection) {
  btfc_texture* texture = nullptr;
  const auto loaded = with_reader(path, [&](btfc_reader* reader, btfc_error* error) {
    return btfc_texture_load(reader, selection, &texture, error);
  });
  if (!loaded) return loaded.error();
  return TexturePtr(texture);
}

Result<Done> choose_selection(const std::string& path, const btfc_wanted& wanted, btfc_selection& selection) {
  return with_reader(path, [&](btfc_reader* reader, btfc_error* error) {
    return btfc_choose(reader, &wanted, &selection, nullptr, error);
  });
}

Result<TexturePtr> load_texture(ByteView file, const btfc_selection* selection) {
  const Result<ReaderPtr> reader = open_in_memory(file);
  if (!reader) return reader.error();
  btfc_error error{};
  btfc_texture* texture = nullptr;
  if (btfc_texture_load(reader->get(), selection, &texture, &error) != BTFC_OK) return from_api(error);
  return TexturePtr(texture);
}

Result<btfc_file_info> file_info(ByteView file) {
  const Result<ReaderPtr> reader = open_in_memory(file);
  if (!reader) return reader.error();
  btfc_file_info info{};
  btfc_reader_info(reader->get(), &info);
  return info;
}

btfc_selection selection_of(const Knobs& knobs) {
  btfc_selection selection{};
  selection.struct_size = sizeof selection;
  selection.levels = knobs.levels;
  selection.gates = knobs.gates;
  selection.culling = knobs.culling;
  return selection;
}

Result<Head> read_file_head(const std::string& path) {
  const Result<FileSource> file = FileSource::open(path);
  if (!file) return file.error();
  const Result<OpenedFile> opened = open_file(file->source());
  if (!opened) return placed(path, opened.error());
  return opened->head;
}

Result<std::uint32_t> map_number(const btfc_texture* texture, const std::string& name) {
  std::string names;
  for (std::uint32_t m = 0; m < btfc_texture_maps(texture); ++m) {
    btfc_map_info info{};
    btfc_texture_map_info(texture, m, &info);
    if (name == info.name) return m;
    names += (m == 0 ? "" : ", ") + std::string(info.name);
  }
  return bad_argument(fmt::format("there is no map '{}', the file has {}", name, names));
}

Result<Image> decode_map(const btfc_texture* texture, std::uint32_t map) {
  btfc_map_info info{};
  if (btfc_texture_map_info(texture, map, &info) != BTFC_OK) return bad_argument("map number out of range");
  Image image;
  image.width = btfc_texture_width(texture);
  image.height = btfc_texture_height(texture);
  image.channels = info.channels;
  image.type = static_cast<SampleType>(info.sample);
  image.colour_space = colour_space_of(info.colour_space).value_or(ColourSpace::unknown);
  image.alpha = static_cast<Alpha>(info.alpha);
  const std::size_t samples = std::size_t{image.width} * image.height * image.channels;
  const std::size_t sample_bytes = info.sample == BTFC_UNORM8 ? 1 : 2;
  Bytes codes(samples * sample_bytes);
  const btfc_result result =
      btfc_decode_rect(texture, nullptr, map, nullptr, 0, 0, image.width, image.height, info.sample,
                       codes.data(), std::size_t{image.width} * image.channels * sample_bytes, codes.size());
  if (result != BTFC_OK) return Error{Status::out_of_memory, btfc_result_name(result), "", 0};
  image.codes.resize(samples);
  for (std::size_t i = 0; i < samples; ++i)
    image.codes[i] = sample_bytes == 1 ? codes[i] : load_u16(&codes[2 * i]);
  return image;
}

}  // namespace btfc
