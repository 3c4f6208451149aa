// Texture -> data set, an image a pair.
#include "tools/texture_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "encoder/for_each_index.h"
#include "encoder/input/read_selection.h"
#include "tools/progress.h"

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

// Scratches that threads borrow, so that what one decoded is there for the next image.
class ScratchPool {
 public:
  explicit ScratchPool(const btfc_texture* texture) : texture_(texture) {}
  ~ScratchPool() {
    for (btfc_scratch* s : free_) btfc_scratch_free(s);
  }
  ScratchPool(const ScratchPool&) = delete;
  ScratchPool& operator=(const ScratchPool&) = delete;
  btfc_scratch* take() {
    const std::lock_guard<std::mutex> hold(lock_);
    if (free_.empty()) return btfc_scratch_new(texture_);
    btfc_scratch* s = free_.back();
    free_.pop_back();
    return s;
  }
  void give(btfc_scratch* s) {
    const std::lock_guard<std::mutex> hold(lock_);
    free_.push_back(s);
  }

 private:
  const btfc_texture* texture_;
  std::mutex lock_;
  std::vector<btfc_scratch*> free_;
};

DatasetInfo info_of(const Head& head, std::optional<SampleType> type) {
  DatasetInfo info;
  info.width = head.width;
  info.height = head.height;
  info.channels = channel_names(head.channels());
  info.type = type.value_or(head.maps[0].type);
  info.colour_space = head.maps[0].colour_space;
  info.quantity = head.quantity;
  info.wraps = head.wrap_u == Wrap::repeat && head.wrap_v == Wrap::repeat;
  return info;
}

std::vector<btfc_directions> directions_of(const std::vector<Direction>& list) {
  std::vector<btfc_directions> out;
  for (const Direction& d : list) {
    const Vector3 v = unit_vector(d);
    btfc_directions one{};
    for (std::size_t i = 0; i < 3; ++i) one.view[i] = static_cast<float>(v[i]);
    out.push_back(one);
  }
  return out;
}

// Which texels are decoded, and what is made of them.
struct Part {
  std::int32_t x = 0, y = 0;
  ImageReduction reduction;
};

// Every pair of `info`, which has the size and the channels that are decoded; views and lights hold their
// vectors as `view`.
Result<Dataset> decode_pairs(const Head& head, const btfc_texture* texture, const DatasetInfo& info,
                             const std::vector<btfc_directions>& views,
                             const std::vector<btfc_directions>& lights, const Part& part,
                             const std::string& scratch_directory) {
  Result<Dataset> created = Dataset::create(reduced_info(info, part.reduction), scratch_directory);
  if (!created) return created.error();
  Dataset& dataset = *created;

  const auto sample = static_cast<btfc_sample>(info.type);
  const std::size_t bytes = info.type == SampleType::unorm8 ? 1 : 2;
  ScratchPool scratches(texture);
  const auto decode = [&](std::size_t p) -> Result<Done> {
    btfc_directions both = views[info.pairs[p].view];
    std::copy_n(lights[info.pairs[p].light].view, 3, both.light);
    btfc_scratch* scratch = scratches.take();
    std::vector<std::uint16_t> codes(info.image_samples());
    std::size_t first = 0;
    for (std::uint32_t m = 0; m < head.maps.size(); ++m) {
      const std::size_t channels = head.maps[m].channels, row = info.width * channels * bytes;
      Bytes raw(row * info.height);
      const btfc_result result = btfc_decode_rect(texture, scratch, m, &both, part.x, part.y, info.width,
                                                  info.height, sample, raw.data(), row, raw.size());
      if (result != BTFC_OK) {
        scratches.give(scratch);
        return Error{Status::out_of_memory, btfc_result_name(result), "", 0};
      }
      for (std::size_t t = 0; t < std::size_t{info.width} * info.height; ++t) {
        for (std::size_t c = 0; c < channels; ++c) {
          const std::size_t at = t * channels + c;
          codes[t * info.channels.size() + first + c] = bytes == 1 ? raw[at] : load_u16(&raw[2 * at]);
        }
      }
      first += channels;
    }
    scratches.give(scratch);
    dataset.write_image(p, reduced_codes(info, std::move(codes), part.reduction));
    return Done{};
  };
  if (const auto done = for_each_index(info.pairs.size(), decode, progress_line("decoding")); !done)
    return done.error();
  return created;
}

}  // namespace

Result<Dataset> decode_dataset(const std::string& path, const btfc_texture* texture,
                               std::optional<SampleType> type, const std::string& scratch_directory) {
  const Result<Head> head = read_file_head(path);
  if (!head) return head.error();
  DatasetInfo info = info_of(*head, type);
  std::vector<btfc_directions> views(head->views), lights(head->lights);
  for (std::uint32_t v = 0; v < head->views; ++v) {
    btfc_texture_view(texture, v, views[v].view);
    info.views.push_back(direction(views[v].view));
  }
  for (std::uint32_t l = 0; l < head->lights; ++l) {
    btfc_texture_light(texture, l, lights[l].view);
    info.lights.push_back(direction(lights[l].view));
  }
  info.pairs.resize(head->pairs);
  for (std::uint32_t p = 0; p < head->pairs; ++p)
    btfc_texture_pair(texture, p, &info.pairs[p].view, &info.pairs[p].light);
  return decode_pairs(*head, texture, info, views, lights, {}, scratch_directory);
}

namespace {

SampleType fine_type(const btfc_texture* texture) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, 0, &info);
  return info.sample == BTFC_FLOAT16 ? SampleType::float16 : SampleType::unorm16;
}

}  // namespace

Result<Dataset> decode_dataset_finely(const std::string& path, const std::string& scratch_directory) {
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) return texture.error();
  return decode_dataset(path, texture->get(), fine_type(texture->get()), scratch_directory);
}

Result<Dataset> decode_dataset_like(const std::string& path, const DatasetInfo& like,
                                    const std::string& scratch_directory) {
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) return texture.error();
  const Result<Head> head = read_file_head(path);
  if (!head) return head.error();
  return decode_dataset_like(*head, texture->get(), like, scratch_directory);
}

Result<Dataset> decode_dataset_like(const Head& head, const btfc_texture* texture, const DatasetInfo& like,
                                    const std::string& scratch_directory) {
  DatasetInfo info = info_of(head, fine_type(texture));
  info.views = like.views;
  info.lights = like.lights;
  info.pairs = like.pairs;
  return decode_pairs(head, texture, info, directions_of(like.views), directions_of(like.lights), {},
                      scratch_directory);
}

Result<Dataset> decode_dataset_part(const std::string& path, const DatasetInfo& like,
                                    const DatasetReadOptions& asked, const std::string& scratch_directory) {
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) return texture.error();
  const Result<Head> head = read_file_head(path);
  if (!head) return head.error();
  btfc_domain domain{};
  btfc_texture_domain(texture->get(), &domain);
  const std::uint32_t x = asked.crop ? asked.crop->x : 0, y = asked.crop ? asked.crop->y : 0;
  const std::uint64_t scale = std::uint64_t{1} << asked.scale_log2;
  // In texels of the file.
  const std::uint64_t left = (x - std::uint64_t{domain.origin_x}) / domain.scale,
                      top = (y - std::uint64_t{domain.origin_y}) / domain.scale,
                      width = like.width * scale / domain.scale, height = like.height * scale / domain.scale;
  const bool on_grid = x >= domain.origin_x && y >= domain.origin_y && scale >= domain.scale &&
                       (x - domain.origin_x) % domain.scale == 0 && (y - domain.origin_y) % domain.scale == 0;
  if (!on_grid || (!head->unbounded && (left + width > head->width || top + height > head->height))) {
    return bad_argument(
        fmt::format("'{}' has {}x{} texels from ({}, {}) of the original on, each of {} a side, which do not "
                    "hold the {}x{} from ({}, {}) on of {} a side",
                    path, head->width, head->height, domain.origin_x, domain.origin_y, domain.scale,
                    like.width, like.height, x, y, scale));
  }
  DatasetInfo info = info_of(*head, fine_type(texture->get()));
  Part part{static_cast<std::int32_t>(left), static_cast<std::int32_t>(top), {}};
  for (std::uint64_t s = domain.scale; s < scale; s *= 2) ++part.reduction.scale_log2;
  if (info.channel_count() != like.channel_count()) {
    const auto channels = channel_numbers(asked.channels, info.channels);
    if (!channels) return channels.error();
    part.reduction.channels = *channels;
  }
  info.width = static_cast<std::uint32_t>(width);
  info.height = static_cast<std::uint32_t>(height);
  info.views = like.views;
  info.lights = like.lights;
  info.pairs = like.pairs;
  return decode_pairs(*head, texture->get(), info, directions_of(like.views), directions_of(like.lights),
                      part, scratch_directory);
}

}  // namespace btfc
