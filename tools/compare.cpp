// btfc compare and synth: how far two images are apart; test material.
#include <algorithm>
#include <cmath>
#include <optional>

#include "encoder/image_file.h"
#include "encoder/metrics/image_metrics.h"
#include "encoder/metrics/texture_statistics.h"
#include "encoder/model_table.h"
#include "encoder/synth/texture_synth.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/file_source.h"
#include "tools/texture_file.h"

namespace btfc {
namespace {

struct CompareArguments {
  std::string a, b, map;
  bool statistics = false;
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

// The ratio of gradients at the joins of a file's texture to those elsewhere; nothing where there are no
// joins.
Result<std::optional<double>> seam_ratio(const std::string& path, const Image& texture) {
  const Result<FileSource> file = FileSource::open(path);
  if (!file) return file.error();
  const Result<OpenedFile> opened = open_file(file->source());
  if (!opened) return placed(path, opened.error());
  const Fitter& fit = fitter(opened->head.model);
  if (fit.joins == nullptr) return std::optional<double>();
  const Result<LoadedItem> item = load_item(file->source(), *opened);
  if (!item) return placed(path, item.error());
  const Result<JoinMask> joins = fit.joins(*item, opened->parm);
  if (!joins) return placed(path, joins.error());
  return join_gradients(texture, *joins).seam_ratio();
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
  if (!m && !arguments.statistics) return stop(m.error());
  const std::uint32_t block =
      std::min(spectrum_block(a->width, a->height), spectrum_block(b->width, b->height));
  const TextureStatistics reference = texture_statistics(*a, block),
                          candidate = texture_statistics(*b, block);
  const double kept = gradient_kept(reference, candidate);
  const double distance = spectrum_distance(reference.spectrum, candidate.spectrum);
  std::optional<double> seams;
  if (is_btfc(arguments.b)) {
    const auto found = seam_ratio(arguments.b, *b);
    if (!found) return stop(found.error());
    seams = *found;
  }

  const bool identical = m && m->differing_samples == 0;
  std::string text;
  if (m) {
    text = fmt::format(
        "psnr_db {:.3f}  rmse_8bit {:.4f}  ssim {:.5f}  peak_8bit {:.3f}  differing samples {} of {}  ",
        m->psnr_db, m->rmse_8bit, m->ssim, m->peak_8bit, m->differing_samples, m->samples);
  }
  text += fmt::format("gradient_kept {:.4f}  spectrum_distance {:.4f}", kept, distance);
  if (seams) text += fmt::format("  seam_ratio {:.4f}", *seams);
  const auto if_aligned = [&](double v) { return m ? number(v) : Json(); };
  const ImageMetrics metrics = m ? *m : ImageMetrics{};
  const Json json = {{"psnr_db", if_aligned(metrics.psnr_db)},
                     {"rmse_8bit", if_aligned(metrics.rmse_8bit)},
                     {"ssim", if_aligned(metrics.ssim)},
                     {"peak_8bit", if_aligned(metrics.peak_8bit)},
                     {"identical", identical},
                     {"differing_samples", m ? Json(metrics.differing_samples) : Json()},
                     {"samples", m ? Json(metrics.samples) : Json()},
                     {"width", a->width},
                     {"height", a->height},
                     {"channels", a->channels},
                     {"gradient_kept", kept},
                     {"spectrum_distance", distance},
                     {"seam_ratio", seams ? Json(*seams) : Json()}};
  if (const auto wrote = arguments.report.write(text, json); !wrote) return stop(wrote.error());
  return identical || arguments.statistics ? kExitOk : kExitDifferent;
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
      "compare",
      "PSNR, RMSE, SSIM and peak between images or files, and how much of A's texture B keeps; exit 7 where "
      "they differ");
  verb->add_option("A", a->a, "an image or a .btfc file: the reference")->required();
  verb->add_option(
          "B", a->b,
          "an image or a .btfc file: the candidate; gradient_kept is its mean gradient over that of A, "
          "of a .btfc file seam_ratio is the mean gradient at patch joins over that elsewhere")
      ->required();
  verb->add_option("--map", a->map, "the map of the .btfc files")->type_name("NAME");
  verb->add_flag("--statistics", a->statistics,
                 "A and B may differ in size, and then have no PSNR, RMSE, SSIM and peak; exit 0");
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
