// btfc compare and synth: how far two images are apart; test material.
#include <cmath>

#include "encoder/image_file.h"
#include "encoder/metrics/image_metrics.h"
#include "encoder/synth/texture_synth.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/texture_file.h"

namespace btfc {
namespace {

struct CompareArguments {
  std::string a, b, map;
  Report report;
};

struct SynthArguments {
  std::string kind, output, size = "512x512", type = "unorm8";
  std::string seed = "1";
  Report report;
};

bool is_btfc(const std::string& path) { return path.size() >= 5 && path.substr(path.size() - 5) == ".btfc"; }

Result<Image> read_side(const std::string& path, const std::string& map) {
  if (!is_btfc(path)) return read_image(path);
  const Result<TexturePtr> texture = load_texture(path);
  if (!texture) return texture.error();
  std::uint32_t number = 0;
  if (!map.empty()) {
    const Result<std::uint32_t> found = map_number(texture->get(), map);
    if (!found) return found.error();
    number = *found;
  } else if (btfc_texture_maps(texture->get()) > 1) {
    return bad_argument(fmt::format("'{}' has several maps, say which with --map", path));
  }
  return decode_map(texture->get(), number);
}

// JSON has no infinity and no NaN: null, and `identical` says which case it is.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(); }

int compare(const CompareArguments& arguments) {
  const auto stop = [](const Error& e) { return fail("compare", e); };
  if (!arguments.map.empty() && !is_btfc(arguments.a) && !is_btfc(arguments.b)) {
    return stop(bad_argument("--map is for .btfc files, neither A nor B is one"));
  }
  const Result<Image> a = read_side(arguments.a, arguments.map);
  if (!a) return stop(a.error());
  const Result<Image> b = read_side(arguments.b, arguments.map);
  if (!b) return stop(b.error());
  const Result<ImageMetrics> m = compare_images(*a, *b);
  if (!m) return stop(m.error());
  const bool identical = m->differing_samples == 0;
  const std::string text = fmt::format(
      "psnr_db {:.3f}  rmse_8bit {:.4f}  ssim {:.5f}  peak_8bit {:.3f}  differing samples {} of {}",
      m->psnr_db, m->rmse_8bit, m->ssim, m->peak_8bit, m->differing_samples, m->samples);
  const Json json = {{"psnr_db", number(m->psnr_db)}, {"rmse_8bit", m->rmse_8bit},
                     {"ssim", number(m->ssim)},       {"peak_8bit", m->peak_8bit},
                     {"identical", identical},        {"differing_samples", m->differing_samples},
                     {"samples", m->samples},         {"width", a->width},
                     {"height", a->height},           {"channels", a->channels}};
  if (const auto wrote = arguments.report.write(text, json); !wrote) return stop(wrote.error());
  return identical ? kExitOk : kExitDifferent;
}

int synth(const SynthArguments& arguments) {
  const auto stop = [](const Error& e) { return fail("synth", e); };
  const auto size = split_numbers(arguments.size, 'x');
  if (!size || size->size() != 2 || (*size)[0] < 1 || (*size)[1] < 1 || (*size)[0] > 65536 ||
      (*size)[1] > 65536) {
    return stop(bad_argument(fmt::format("--size is '{}', expected WxH with 1 to 65536", arguments.size)));
  }
  const auto seed = parse_u64(arguments.seed);
  if (!seed)
    return stop(
        bad_argument(fmt::format("--seed is '{}', expected a whole number below 2^64", arguments.seed)));
  TextureOptions options;
  options.width = (*size)[0];
  options.height = (*size)[1];
  options.seed = *seed;
  options.type = arguments.type == "unorm8"    ? SampleType::unorm8
                 : arguments.type == "unorm16" ? SampleType::unorm16
                                               : SampleType::float16;
  const Result<Image> image = synthesize_texture(arguments.kind, options);
  if (!image) return stop(image.error());
  if (const auto wrote = write_image(arguments.output, *image); !wrote) return stop(wrote.error());
  const Json json = {{"output", arguments.output},
                     {"kind", arguments.kind},
                     {"width", options.width},
                     {"height", options.height}};
  if (const auto wrote = arguments.report.write("", json); !wrote) return stop(wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_compare(CLI::App& app) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* verb = app.add_subcommand(
      "compare", "PSNR, RMSE, SSIM and peak between images or files; exit 7 where they differ");
  verb->add_option("A", a->a, "an image or a .btfc file")->required();
  verb->add_option("B", a->b, "an image or a .btfc file")->required();
  verb->add_option("--map", a->map, "the map of the .btfc files")->type_name("NAME");
  a->report.attach(*verb);
  return {verb, [a] { return compare(*a); }};
}

Verb add_synth(CLI::App& app) {
  auto a = std::make_shared<SynthArguments>();
  CLI::App* verb = app.add_subcommand("synth", "write a procedural test texture");
  std::string kinds;
  for (const TextureKind& kind : texture_kinds()) {
    kinds += fmt::format("{}{} ({})", kinds.empty() ? "" : ", ", kind.name, kind.texture_class);
  }
  verb->add_option("KIND", a->kind, kinds)->required();
  verb->add_option("-o,--output", a->output, "the image to write")->required()->type_name("OUT.png|.exr");
  verb->add_option("--size", a->size, "texels (default 512x512)")->type_name("WxH");
  verb->add_option("--seed", a->seed, "seed (default 1)")->type_name("N");
  verb->add_option("--type", a->type, "unorm8, unorm16 or float16 (default unorm8)")
      ->check(CLI::IsMember({"unorm8", "unorm16", "float16"}))
      ->type_name("TYPE");
  a->report.attach(*verb);
  return {verb, [a] { return synth(*a); }};
}

}  // namespace btfc
