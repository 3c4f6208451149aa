// Reading, and refusing options that are of the other kind of input.
#include "tools/fit_input.h"

#include <fmt/format.h>

#include "btfc/btfc.h"
#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/run_on_threads.h"
#include "format/limits.h"
#include "tools/scene_input.h"

namespace btfc {

bool FitSources::has_dataset() const { return inputs.size() == 1 && is_dataset(inputs[0]); }

void add_meta(FitResult& fitted) {
  fitted.meta["btfc:writer"] = fmt::format("btfc {}", btfc_version());
  fitted.chunks.push_back({{kMeta, kSafeToCopy}, write_meta(fitted.meta)});
}

Result<FitInput> read_maps(const FitSources& s) {
  const Result<std::optional<Scene>> scene = s.dataset.scene();
  if (!scene) return scene.error();
  FitInput input;
  const auto add = [&](const std::string& name, const std::string& path) -> Result<Done> {
    Result<Image> image = read_image(path);
    if (image && *scene) image = scene_image(**scene, *image, name);
    if (!image) return image.error();
    for (const NamedImage& other : input.maps) {
      if (other.name == name) return bad_argument(fmt::format("two maps are named '{}'", name));
    }
    input.maps.push_back({name, *std::move(image)});
    return Done{};
  };
  if (s.inputs.size() > 1) return bad_argument("more than one INPUT; give the other maps as --map NAME=FILE");
  for (const std::string& path : s.inputs) {
    if (const auto added = add("image", path); !added) return added.error();
  }
  for (const std::string& text : s.maps) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || !valid_map_name(text.substr(0, equals))) {
      return bad_argument(
          fmt::format("--map is '{}', expected NAME=FILE with a name of 1 to 24 of A-Z a-z 0-9 _ -", text));
    }
    if (const auto added = add(text.substr(0, equals), text.substr(equals + 1)); !added) return added.error();
  }
  if (input.maps.empty()) return bad_argument("there is no INPUT and no --map NAME=FILE");
  std::uint32_t channels = 0;
  for (const NamedImage& map : input.maps) channels += map.image.channels;
  if (input.maps.size() > kMaxMaps || channels > kMaxChannels) {
    return bad_argument(fmt::format("{} maps with {} channels, expected at most {} with {}",
                                    input.maps.size(), channels, kMaxMaps, kMaxChannels));
  }
  if (!s.colour_space.empty()) {
    const auto space = colour_space_of(s.colour_space);
    if (!space)
      return bad_argument(fmt::format("--colour-space is '{}', see spec/registry.md", s.colour_space));
    for (NamedImage& map : input.maps) map.image.colour_space = *space;
  }
  return input;
}

Result<Done> with_dataset(const FitSources& s, const std::string& model, const UseInput& use) {
  if (s.inputs.size() != 1 || !s.maps.empty()) {
    return bad_argument(
        fmt::format("model {} takes one data set as INPUT (see 'btfc help convert'), and no --map", model));
  }
  if (!s.colour_space.empty()) return bad_argument("--colour-space is for images");
  if (!is_dataset(s.inputs[0])) {
    return bad_argument(
        fmt::format("'{}' is no data set of a known kind, which model {} takes", s.inputs[0], model));
  }
  Result<Done> used = bad_argument("");
  run_on_threads(s.dataset.threads, [&] {
    const Result<DatasetRead> set = s.dataset.read(s.inputs[0]);
    if (!set) {
      used = set.error();
      return;
    }
    FitInput input;
    input.dataset = &set->dataset;
    used = use(input, set->images_read);
  });
  return used;
}

Result<Done> with_input(const FitSources& s, const std::string& model, const UseInput& use) {
  if (s.has_dataset()) return with_dataset(s, model, use);
  if (s.dataset.given()) return bad_argument("--crop, --missing and --scratch are for data sets");
  const Result<FitInput> input = read_maps(s);
  if (!input) return input.error();
  Result<Done> used = bad_argument("");
  run_on_threads(s.dataset.threads, [&] { used = use(*input, 0); });
  return used;
}

}  // namespace btfc
