// Texture -> data set, an image a pair.
#include "tools/texture_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/for_each_index.h"
#include "tools/command.h"

namespace btfc {
namespace {

std::vector<std::string> channel_names(std::uint32_t count) {
  if (count == 1) return {"Y"};
  if (count == 3) return {"R", "G", "B"};
  if (count == 4) return {"R", "G", "B", "A"};
  std::vector<std::string> names;
  for (std::uint32_t c = 0; c < count; ++c) names.push_back(fmt::format("C{}", c));
  return names;
}

// To 1e-4 degrees: the file keeps directions to some 1e-5 degrees, and names of files are ordered by them.
Direction direction(const float (&v)[3]) {
  const Direction d = direction_from_vector({v[0], v[1], std::max(v[2], 0.0f)});
  const auto rounded = [](double radians) { return std::round(degrees(radians) * 1e4) / 1e4; };
  return direction_from_degrees(rounded(d.theta), rounded(d.phi));
}

}  // namespace

Result<Dataset> decode_dataset(const std::string& path, const btfc_texture* texture,
                               std::optional<SampleType> type, const std::string& scratch_directory) {
  const Result<Head> head = read_file_head(path);
  if (!head) return head.error();
  DatasetInfo info;
  info.width = head->width;
  info.height = head->height;
  info.channels = channel_names(head->channels());
  info.type = type.value_or(head->maps[0].type);
  info.colour_space = head->maps[0].colour_space;
  info.quantity = head->quantity;
  info.wraps = head->wrap_u == Wrap::repeat && head->wrap_v == Wrap::repeat;
  std::vector<btfc_directions> views(head->views), lights(head->lights);
  for (std::uint32_t v = 0; v < head->views; ++v) {
    btfc_texture_view(texture, v, views[v].view);
    info.views.push_back(direction(views[v].view));
  }
  for (std::uint32_t l = 0; l < head->lights; ++l) {
    btfc_texture_light(texture, l, lights[l].light);
    info.lights.push_back(direction(lights[l].light));
  }
  info.pairs.resize(head->pairs);
  for (std::uint32_t p = 0; p < head->pairs; ++p)
    btfc_texture_pair(texture, p, &info.pairs[p].view, &info.pairs[p].light);
  Result<Dataset> created = Dataset::create(info, scratch_directory);
  if (!created) return created.error();
  Dataset& dataset = *created;

  const auto sample = static_cast<btfc_sample>(info.type);
  const std::size_t bytes = info.type == SampleType::unorm8 ? 1 : 2;
  const auto decode = [&](std::size_t p) -> Result<Done> {
    btfc_directions both = views[info.pairs[p].view];
    std::copy_n(lights[info.pairs[p].light].light, 3, both.light);
    std::vector<std::uint16_t> codes(info.image_samples());
    std::size_t first = 0;
    for (std::uint32_t m = 0; m < head->maps.size(); ++m) {
      const std::size_t channels = head->maps[m].channels, row = info.width * channels * bytes;
      Bytes raw(row * info.height);
      const btfc_result result = btfc_decode_rect(texture, nullptr, m, &both, 0, 0, info.width, info.height,
                                                  sample, raw.data(), row, raw.size());
      if (result != BTFC_OK) return Error{Status::out_of_memory, btfc_result_name(result), "", 0};
      for (std::size_t t = 0; t < std::size_t{info.width} * info.height; ++t) {
        for (std::size_t c = 0; c < channels; ++c) {
          const std::size_t at = t * channels + c;
          codes[t * info.channels.size() + first + c] = bytes == 1 ? raw[at] : load_u16(&raw[2 * at]);
        }
      }
      first += channels;
    }
    dataset.write_image(p, codes);
    return Done{};
  };
  if (const auto done = for_each_index(info.pairs.size(), decode, progress_line("decoding")); !done)
    return done.error();
  return created;
}

Result<Dataset> decode_dataset_finely(const std::string& path, const std::string& scratch_directory) {
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) return texture.error();
  btfc_map_info info{};
  btfc_texture_map_info(texture->get(), 0, &info);
  const SampleType type = info.sample == BTFC_FLOAT16 ? SampleType::float16 : SampleType::unorm16;
  return decode_dataset(path, texture->get(), type, scratch_directory);
}

}  // namespace btfc
