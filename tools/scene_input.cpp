// Scenes applied to images and options.
#include "tools/scene_input.h"

#include <fmt/format.h>

#include <algorithm>

#include "encoder/image_reduction.h"
#include "encoder/input/dataset_read.h"

namespace btfc {
namespace {

std::vector<std::string> names_of_channels(std::uint32_t count) {
  if (count < 3) return count == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"Y", "A"};
  return count == 3 ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"R", "G", "B", "A"};
}

}  // namespace

Result<Rectangle> scene_texels(const Scene& scene, std::uint32_t width, std::uint32_t height,
                               const std::string& what) {
  DatasetReadOptions options;
  options.crop = scene.region;
  return kept_texels(options, width, height, what);
}

Result<Image> scene_image(const Scene& scene, const Image& image, const std::string& what) {
  if (scene.directions()) {
    return bad_argument(
        fmt::format("'{}' is an image, which has no directions: a scene for it has no views, lights, pairs "
                    "and weights",
                    what));
  }
  const Result<Rectangle> r = scene_texels(scene, image.width, image.height, what);
  if (!r) return r.error();
  const Image part = crop(image, r->x, r->y, r->width, r->height);
  const auto channels = channel_numbers(scene.channels, names_of_channels(image.channels));
  if (!channels) return channels.error();
  if (const auto fits = check_scale(part.width, part.height, scene.scale_log2(), what); !fits)
    return fits.error();
  return reduced(part, {*channels, scene.scale_log2()});
}

Result<Done> apply_target(const Scene& scene, const ModelFormat* model, OptionValues& values) {
  if (!scene.target) return Done{};
  if (values.contains("psnr") || values.contains("bytes"))
    return bad_argument("the scene has a target, and --psnr or --bytes is given; expected one of them");
  const std::string name = scene.target->psnr ? "psnr" : "bytes";
  if (model != nullptr) {
    const std::span<const OptionSpec> options = fitter(model->id).options;
    if (std::none_of(options.begin(), options.end(), [&](const OptionSpec& o) { return name == o.name; })) {
      return bad_argument(
          fmt::format("the scene has a target, and model {} has no option --{} to meet it with; gm has, and "
                      "--model auto chooses a model for it",
                      model->name, name));
    }
  }
  values[name] =
      scene.target->psnr ? fmt::format("{}", *scene.target->psnr) : fmt::format("{}", *scene.target->bytes);
  return Done{};
}

}  // namespace btfc
