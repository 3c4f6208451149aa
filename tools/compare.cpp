// btfc compare: how far two images or two data sets are apart.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <optional>

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/metrics/dataset_metrics.h"
#include "encoder/metrics/image_metrics.h"
#include "encoder/metrics/texture_distance.h"
#include "encoder/metrics/texture_statistics.h"
#include "encoder/model_table.h"
#include "encoder/run_on_threads.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/compare_datasets.h"
#include "tools/contact_sheet.h"
#include "tools/dataset_input.h"
#include "tools/file_source.h"
#include "tools/progress.h"
#include "tools/scene_input.h"
#include "tools/texture_dataset.h"
#include "tools/texture_file.h"

namespace btfc {
namespace {

struct CompareArguments {
  std::string a, b, map, measures = "ssim,mae_lab,flip";
  std::string sheet;
  bool statistics = false, resample = false;
  DatasetInput dataset;
  Report report;
};

constexpr std::size_t kSheetPairs = 8;

bool is_btfc(const std::string& path) { return file_extension(path) == "btfc"; }

// Whether a side is seen under several directions.
Result<bool> is_btf(const std::string& path) {
  if (!is_btfc(path)) return is_dataset(path);
  const Result<Head> head = read_file_head(path);
  if (!head) return head.error();
  return head->views > 1 || head->lights > 1;
}

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

// "ssim,flip": the measures that cost time.
Result<MetricOptions> metric_options(const std::string& text) {
  MetricOptions options{false, false, false};
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    if (name == "ssim") {
      options.ssim = true;
    } else if (name == "mae_lab") {
      options.mae_lab = true;
    } else if (name == "flip") {
      options.flip = true;
    } else if (name != "psnr") {
      return bad_argument(fmt::format("--measures has '{}', expected psnr, ssim, mae_lab, flip", name));
    }
    begin = end + 1;
  }
  return options;
}

// B beside a reference that was read with a scene.
Result<Dataset> candidate_in_scene(const CompareArguments& a, const Scene& scene, const DatasetInfo& like) {
  const std::optional<Scene> held = scene;
  const Result<DatasetReadOptions> asked = a.dataset.options(held);
  if (!asked) return asked.error();
  return decode_dataset_part(a.b, like, *asked, a.dataset.scratch);
}

int compare_data(const CompareArguments& a, const MetricOptions& measures) {
  const Result<std::optional<Scene>> scene = a.dataset.scene();
  if (!scene) return fail("compare", scene.error());
  if (*scene && is_btfc(a.a))
    return fail("compare",
                bad_argument("--scene of data sets: A is a .btfc file, expected the data set itself"));
  const auto side = [&](const std::string& path) -> Result<Dataset> {
    if (is_btfc(path)) return decode_dataset_finely(path, a.dataset.scratch);
    Result<DatasetRead> read = a.dataset.read(path);
    if (!read) return read.error();
    return std::move(read->dataset);
  };
  const Result<Dataset> reference = side(a.a);
  if (!reference) return fail("compare", reference.error());
  if (a.resample && !is_btfc(a.b))
    return fail("compare", bad_argument("--resample is for a .btfc file as B"));
  const Result<Dataset> candidate = *scene && is_btfc(a.b) ? candidate_in_scene(a, **scene, reference->info())
                                    : a.resample
                                        ? decode_dataset_like(a.b, reference->info(), a.dataset.scratch)
                                        : side(a.b);
  if (!candidate) return fail("compare", candidate.error());
  const Result<DatasetMetrics> m =
      compare_datasets(*reference, *candidate, {measures, progress_line("comparing")});
  if (!m) return fail("compare", m.error());
  if (!a.sheet.empty()) {
    const auto wrote = write_image(a.sheet, comparison_sheet(*reference, *candidate, kSheetPairs));
    if (!wrote) return fail("compare", wrote.error());
  }
  const Json json = dataset_metrics_json(*m);
  if (const auto wrote = a.report.write(dataset_metrics_text(*m), json); !wrote)
    return fail("compare", wrote.error());
  return m->differing_samples == 0 ? kExitOk : kExitDifferent;
}

// What textures that are not aligned have in common, beside what the reference's own crops have.
void add_distances(const TextureDistances& d, std::string& text, Json& json) {
  const auto add = [&](const char* name, const AgainstCeiling& v, double ratio) {
    text +=
        fmt::format("\n{} {:.4f} (crop against crop {:.4f}, ratio {:.3f})", name, v.value, v.ceiling, ratio);
    json[name] = {{"value", number_or_null(v.value)},
                  {"ceiling", number_or_null(v.ceiling)},
                  {"ratio", number_or_null(ratio)}};
  };
  json["crop"] = d.crop;
  add("marginal_distance", d.marginals, d.marginals.ratio());
  add("power_spectrum_distance", d.spectrum, d.spectrum.ratio());
  add("autocorrelation_distance", d.autocorrelation, d.autocorrelation.ratio());
  add("stsim2", d.stsim2, d.stsim2_ratio());
}

int compare(const CompareArguments& arguments) {
  const auto stop = [](const Error& e) { return fail("compare", e); };
  const Result<MetricOptions> measures = metric_options(arguments.measures);
  if (!measures) return stop(measures.error());
  const Result<bool> a_btf = is_btf(arguments.a), b_btf = is_btf(arguments.b);
  if (!a_btf) return stop(a_btf.error());
  if (!b_btf) return stop(b_btf.error());
  if (*a_btf || *b_btf) {
    int code = kExitOk;
    run_on_threads(arguments.dataset.threads, [&] { code = compare_data(arguments, *measures); });
    return code;
  }
  if (!arguments.sheet.empty()) return stop(bad_argument("--sheet is for data sets"));
  if (arguments.dataset.given())
    return stop(bad_argument("--crop, --missing and --scratch are for data sets"));
  if (!arguments.map.empty() && !is_btfc(arguments.a) && !is_btfc(arguments.b)) {
    return stop(bad_argument("--map is for .btfc files, neither A nor B is one"));
  }
  const Result<std::optional<Scene>> scene = arguments.dataset.scene();
  if (!scene) return stop(scene.error());
  // A .btfc file is taken to be made for the scene.
  const auto side = [&](const std::string& path) -> Result<Image> {
    const Result<Image> image = read_side(path, arguments.map);
    return image && *scene && !is_btfc(path) ? scene_image(**scene, *image, path) : image;
  };
  const Result<Image> a = side(arguments.a);
  if (!a) return stop(a.error());
  const Result<Image> b = side(arguments.b);
  if (!b) return stop(b.error());
  const Result<ImageMetrics> m = compare_images(*a, *b, *measures);
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
        "psnr_db {:.3f}  rmse_8bit {:.4f}  ssim {:.5f}  mae_lab {:.4f}  flip {:.5f}  peak_8bit {:.3f}  "
        "differing "
        "samples {} of {}  ",
        m->psnr_db, m->rmse_8bit, m->ssim, m->mae_lab, m->flip, m->peak_8bit, m->differing_samples,
        m->samples);
  }
  text += fmt::format("gradient_kept {:.4f}  spectrum_distance {:.4f}", kept, distance);
  if (seams) text += fmt::format("  seam_ratio {:.4f}", *seams);
  const auto if_aligned = [&](double v) { return m ? number_or_null(v) : Json(); };
  const ImageMetrics metrics = m ? *m : ImageMetrics{};
  Json json = {{"psnr_db", if_aligned(metrics.psnr_db)},
               {"rmse_8bit", if_aligned(metrics.rmse_8bit)},
               {"ssim", if_aligned(metrics.ssim)},
               {"mae_lab", if_aligned(metrics.mae_lab)},
               {"de76", if_aligned(metrics.de76)},
               {"flip", if_aligned(metrics.flip)},
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
  if (arguments.statistics && std::min({a->width, a->height, b->width, b->height}) >= 2 * kLeastTextureCrop) {
    const Result<TextureDistances> distances = texture_distances(*a, *b);
    if (!distances) return stop(distances.error());
    add_distances(*distances, text, json["distances"]);
  }
  if (const auto wrote = arguments.report.write(text, json); !wrote) return stop(wrote.error());
  return identical || arguments.statistics ? kExitOk : kExitDifferent;
}

}  // namespace

Verb add_compare(CLI::App& app) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* verb = app.add_subcommand("compare",
                                      "PSNR, RMSE, SSIM, MAE in CIE Lab, FLIP and peak between images, files "
                                      "or data sets, and how much of A's "
                                      "texture B keeps; exit 7 where they differ");
  verb->add_option("A", a->a, "an image, a .btfc file or a data set (see convert): the reference")
      ->required();
  verb->add_option("B", a->b,
                   "what A is: the candidate, of a BTF also the .btfc file made of it; gradient_kept is its "
                   "mean gradient over that of A, "
                   "of a .btfc file seam_ratio is the mean gradient at patch joins over that elsewhere")
      ->required();
  verb->add_option("--map", a->map, "the map of the .btfc files")->type_name("NAME");
  verb->add_flag(
      "--statistics", a->statistics,
      "of images: also distances between textures that are not aligned, beside those between crops of "
      "A; A and B may differ in size, and then have no PSNR, RMSE, SSIM and peak; exit 0");
  verb->add_option("--measures", a->measures, "which of the slower measures (default ssim,mae_lab,flip)")
      ->type_name("psnr,ssim,…");
  verb->add_flag(
      "--resample", a->resample,
      "of data sets: B, a .btfc file, is decoded under A's directions and pairs, whatever its own are");
  verb->add_option(
          "--sheet", a->sheet,
          "of data sets: also a picture of eight pairs, from the steepest to the most grazing, A above B")
      ->type_name("OUT.png");
  a->dataset.attach(*verb);
  a->dataset.attach_scene(*verb);
  a->report.attach(*verb);
  return {verb, [a] { return compare(*a); }};
}

}  // namespace btfc
