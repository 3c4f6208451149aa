// Options -> sample and shape -> synthesis -> chunks.
#include "encoder/models/patch_fit.h"

#include <fmt/format.h>

#include <algorithm>

#include "encoder/models/patch_sample.h"
#include "encoder/models/patch_synthesis.h"
#include "encoder/models/patch_trim.h"
#include "encoder/run_on_threads.h"
#include "format/limits.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"sample", "X,Y,W,H|auto",
     "the part of the input that becomes the sample (default: all of it); auto: the window of --sample-size "
     "whose texture is most like the input"},
    {"sample-size", "WxH", "size of the sample that --sample auto looks for (default 128x128)"},
    {"size", "WxH", "texture size (default: all that the patches of --k cover)"},
    {"k", "N|NxM", "patches a side (default: as --size needs)"},
    {"wb", "N", "patch size w_B in texels (default 3/8 of the sample's shorter side)"},
    {"we", "N", "overlap w_E in texels, 1 to w_B/2 (default w_B/6)"},
    {"blend", "liang|quilting",
     "how patches join: feathering or minimum error boundary cut (default quilting)"},
    {"pack", "rgba8|packed", "how cuts are stored (default packed)"},
    {"tau", "T", "threshold of the patch search, 0 to 10 (default 0.2)"},
    {"tries", "N",
     "quilting: of N candidates of the patch search the one with the best cuts, 1 to 65536 (default 64; 1 is "
     "the paper's "
     "choice)"},
    {"tileable", nullptr, "a texture that wraps, k (w_B - w_E) texels a side"},
    {"trim-sample", nullptr, "store only the blocks of 4x4 texels of the sample that the texture shows"},
    {"synthesized", "OUT.png", "also write the synthesised texture as the encoder holds it"},
};

constexpr std::uint32_t kAutomaticSide = 128;

// With --sample auto only the size is settled.
Result<SampleWindow> sample_window(const OptionValues& options, const Image& image) {
  const auto text = find_option(options, "sample");
  const auto size = parse_pair(options, "sample-size", 2, kMaxSide, false);
  if (!size) return size.error();
  if (text == "auto") {
    const SampleWindow w{0, 0, *size ? (*size)->first : std::min(kAutomaticSide, image.width),
                         *size ? (*size)->second : std::min(kAutomaticSide, image.height)};
    if (w.width <= image.width && w.height <= image.height) return w;
    return bad_argument(fmt::format("--sample-size is {}x{}, expected a window of the input of {}x{}",
                                    w.width, w.height, image.width, image.height));
  }
  if (*size) return bad_argument("--sample-size is for --sample auto");
  if (!text) return SampleWindow{0, 0, image.width, image.height};
  const auto n = split_numbers(*text, ',');
  if (!n || n->size() != 4)
    return bad_argument(fmt::format("--sample is '{}', expected X,Y,W,H or auto", *text));
  const SampleWindow w{(*n)[0], (*n)[1], (*n)[2], (*n)[3]};
  if (w.width < 2 || w.height < 2 || std::uint64_t{w.x} + w.width > image.width ||
      std::uint64_t{w.y} + w.height > image.height) {
    return bad_argument(
        fmt::format("--sample is '{}', expected at least 2x2 texels inside the input of {}x{}", *text,
                    image.width, image.height));
  }
  return w;
}

// The side image of a map: OUT.png for one map, OUT-NAME.png for several.
std::string side_path(const std::string& path, const std::string& map, std::size_t maps) {
  if (maps == 1) return path;
  const std::size_t slash = path.find_last_of('/');
  const std::size_t dot = path.find_last_of('.');
  const bool has_dot = dot != std::string::npos && (slash == std::string::npos || dot > slash);
  return has_dot ? path.substr(0, dot) + '-' + map + path.substr(dot) : path + '-' + map;
}

std::string text_of(double value) { return fmt::format("{:g}", value); }

void report_choice(const SampleChoice& choice, FitResult& result) {
  const SampleWindow& w = choice.window;
  const std::string window = fmt::format("{},{},{},{}", w.x, w.y, w.width, w.height);
  const auto part = [&](const char* name, double v) {
    result.report.push_back({name, fmt::format("{:.4f}", v)});
  };
  result.report.push_back({"sample", window, false});
  part("sample_gradient", choice.score.gradient);
  part("sample_spectrum", choice.score.spectrum);
  part("sample_colour", choice.score.colour);
  part("sample_seams", choice.score.seams);
  part("sample_score", choice.score.total());
  result.meta["patch.sample"] = window;
}

}  // namespace

const std::span<const OptionSpec> kPatchFitOptions = kOptions;

Result<FitResult> patch_fit(const FitInput& input, const FitSettings& settings) {
  Result<SampleWindow> window = sample_window(settings.options, input.maps[0].image);
  if (!window) return window.error();
  const auto tau = parse_double(settings.options, "tau", 0, 10);
  if (!tau) return tau.error();
  const auto tries = parse_u32(settings.options, "tries", 1, 65536);
  if (!tries) return tries.error();

  Head head;
  std::vector<Image> samples;
  for (const NamedImage& map : input.maps) {
    const Image& image = map.image;
    if (image.width != input.maps[0].image.width || image.height != input.maps[0].image.height) {
      return bad_argument(fmt::format("map '{}' has {}x{} texels, expected {}x{} as map '{}' has", map.name,
                                      image.width, image.height, input.maps[0].image.width,
                                      input.maps[0].image.height, input.maps[0].name));
    }
    head.maps.push_back({map.name, image.channels, image.type, image.colour_space, image.alpha});
  }
  Result<PatchShape> shape = patch_shape_from_options(settings.options, window->width, window->height, head);
  if (!shape) return shape.error();

  SynthesisSettings synthesis;
  synthesis.tau = tau->value_or(0.2);
  synthesis.tries = tries->value_or(64);
  synthesis.seed = settings.seed;
  synthesis.progress = settings.progress;
  FitResult result;
  if (find_option(settings.options, "sample") == "auto") {
    SampleChoice choice;
    run_on_threads(settings.threads, [&] { choice = choose_sample(input.maps, *shape, synthesis); });
    *window = choice.window;
    report_choice(choice, result);
  }
  for (const NamedImage& map : input.maps) {
    samples.push_back(crop(map.image, window->x, window->y, window->width, window->height));
  }

  RowSink sink;
  const auto side = find_option(settings.options, "synthesized");
  if (side) {
    for (std::size_t m = 0; m < samples.size(); ++m) {
      SideImage one{side_path(*side, head.maps[m].name, samples.size()), samples[m]};
      one.image.width = head.width;
      one.image.height = head.height;
      one.image.codes.resize(std::size_t{head.width} * head.height * one.image.channels);
      result.side_images.push_back(std::move(one));
    }
    sink = [&](std::uint32_t y, std::span<const std::uint16_t* const> maps) {
      if (y >= head.height) return;
      for (std::size_t m = 0; m < maps.size(); ++m) {
        Image& image = result.side_images[m].image;
        std::copy_n(maps[m], std::size_t{image.width} * image.channels, &image.codes[image.index(0, y, 0)]);
      }
    };
  }

  PatchRecipe recipe;
  run_on_threads(settings.threads, [&] { recipe = synthesize_patches(*shape, samples, synthesis, sink); });

  const double used =
      trim_sample(head, *shape, recipe, find_option(settings.options, "trim-sample").has_value());
  result.report.push_back({"sample_used", fmt::format("{:.4f}", used)});
  std::vector<SampleCodes> codes;
  for (Image& sample : samples) codes.push_back(std::move(sample.codes));
  result.chunks = patch_write(head, *shape, recipe, codes);
  result.meta["patch.seed"] = std::to_string(settings.seed);
  result.meta["patch.tau"] = text_of(synthesis.tau);
  if (shape->blend == PatchBlend::quilting) result.meta["patch.tries"] = std::to_string(synthesis.tries);
  return result;
}

}  // namespace btfc
