// Reading data sets for the verbs.
#include "tools/dataset_input.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "format/options.h"
#include "tools/progress.h"

namespace btfc {
namespace {

std::string channel_list(const DatasetInfo& info) {
  std::string text;
  for (const std::string& name : info.channels) text += (text.empty() ? "" : ",") + name;
  return text;
}

}  // namespace

void DatasetInput::attach(CLI::App& verb, bool models) {
  verb.add_option("--crop", crop, "of data sets: the texels to read (default: all)")->type_name("X,Y,W,H");
  verb.add_option(
          "--missing", missing,
          models
              ? "of data sets: images that the directions ask for and are not there; model: left out of the "
                "fit and reconstructed, by car, gmrf and car3d (default error)"
              : "of data sets: images that the directions ask for and are not there (default error)")
      ->check(CLI::IsMember(models ? std::vector<std::string>{"error", "skip", "model"}
                                   : std::vector<std::string>{"error", "skip"}))
      ->type_name(models ? "error|skip|model" : "error|skip");
  verb.add_option("--scratch", scratch,
                  "of data sets: where samples are kept meanwhile (default $TMPDIR or /var/tmp)")
      ->type_name("DIR");
  verb.add_option("--threads", threads, "threads (default: all)")->check(CLI::Range(1, 1024))->type_name("N");
}

void DatasetInput::attach_scene(CLI::App& verb) {
  verb.add_option("--scene", scene_file,
                  "only what a scene shows: directions and how often, distances, texels, channels, as "
                  "spec/scene.md has it")
      ->type_name("SCENE.json");
}

Result<std::optional<Scene>> DatasetInput::scene() const {
  if (scene_file.empty()) return std::optional<Scene>();
  Result<Scene> scene = read_scene(scene_file);
  if (!scene) return scene.error();
  return std::optional<Scene>(*std::move(scene));
}

Result<std::optional<Rectangle>> DatasetInput::texels(const std::optional<Scene>& scene) const {
  if (crop.empty()) return scene ? scene->region : std::nullopt;
  if (scene && scene->region) return bad_argument("--crop is given, and the scene has a region");
  const auto n = split_numbers(crop, ',');
  if (!n || n->size() != 4 || (*n)[2] < 1 || (*n)[3] < 1) {
    return bad_argument(fmt::format("--crop is '{}', expected X,Y,W,H with at least one texel", crop));
  }
  return std::optional(Rectangle{(*n)[0], (*n)[1], (*n)[2], (*n)[3]});
}

Result<Domain> DatasetInput::domain(const Scene& scene) const {
  const auto region = texels(scene);
  if (!region) return region.error();
  const Rectangle r = region->value_or(Rectangle{});
  return scene_domain(scene, r.x, r.y);
}

Result<DatasetReadOptions> DatasetInput::options(const std::optional<Scene>& scene) const {
  DatasetReadOptions options;
  const auto kept = texels(scene);
  if (!kept) return kept.error();
  options.crop = *kept;
  options.skip_missing = missing != "error";
  options.scratch_directory = scratch;
  if (!scene) return options;
  options.channels = scene->channels;
  options.scale_log2 = scene->scale_log2();
  options.choose = [&scene](const DatasetInfo& info) { return scene_pairs(*scene, info); };
  return options;
}

Result<DatasetRead> DatasetInput::read(const std::string& path) const {
  const Result<std::optional<Scene>> found = scene();
  if (!found) return found.error();
  Result<DatasetReadOptions> wanted = options(*found);
  if (!wanted) return wanted.error();
  std::size_t there = 0;
  if (const ChoosePairs choose = wanted->choose) {
    wanted->choose = [&there, choose](const DatasetInfo& info) {
      there = info.pairs.size();
      return choose(info);
    };
  }
  wanted->progress = progress_line("reading");
  Result<DatasetRead> read = read_dataset(path, *wanted);
  if (read) {
    if (read->images_read < there)
      read->notes.push_back(fmt::format("{} of {} images were read", read->images_read, there));
    for (const std::string& note : read->notes) fmt::print(stderr, "btfc: {}: {}\n", path, note);
  }
  return read;
}

Json dataset_json(const DatasetRead& read) {
  const DatasetInfo& info = read.dataset.info();
  return {{"kind", read.kind},
          {"width", info.width},
          {"height", info.height},
          {"channels", info.channels.size()},
          {"channel_names", info.channels},
          {"sample_type", name_of(info.type)},
          {"colour_space", name_of(info.colour_space)},
          {"quantity", name_of(info.quantity)},
          {"wraps", info.wraps},
          {"views", info.views.size()},
          {"lights", info.lights.size()},
          {"pairs", info.pairs.size()},
          {"full_product", info.full_product()},
          {"images_read", read.images_read},
          {"raw_bytes", info.image_samples() * info.pairs.size() * (info.type == SampleType::unorm8 ? 1 : 2)},
          {"scratch_bytes", read.dataset.scratch_bytes()},
          {"notes", read.notes}};
}

std::string dataset_text(const DatasetRead& read) {
  const DatasetInfo& info = read.dataset.info();
  return fmt::format("{}: {}x{} texels, {} {} channels ({}), {} views, {} lights, {} pairs{}, {}, {}{}",
                     read.kind, info.width, info.height, info.channels.size(), name_of(info.type),
                     channel_list(info), info.views.size(), info.lights.size(), info.pairs.size(),
                     info.full_product() ? "" : " (not all)", name_of(info.colour_space),
                     name_of(info.quantity), info.wraps ? ", repeats" : "");
}

}  // namespace btfc
