// btfc encode: images in, one file out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/model_table.h"
#include "encoder/output/atomic_file.h"
#include "format/container.h"
#include "tools/auto_model.h"
#include "tools/command.h"
#include "tools/fit_input.h"
#include "tools/measure_file.h"
#include "tools/progress.h"
#include "tools/quality_report.h"
#include "tools/scene_input.h"
#include "tools/size_report.h"

namespace btfc {
namespace {

struct Arguments {
  FitSources sources;
  std::string output, model, codec = "zstd";
  std::optional<int> level;
  std::string seed = "1";
  bool measure = false;
  OptionValues model_options;
  Report report;
};

constexpr const char* kAutomatic = "auto";

// What was made of the input.
struct Made {
  const ModelFormat* model = nullptr;
  FitResult fitted;
  std::optional<QualityCurve> curve;
  std::optional<AutomaticFit> automatic;  // its fitted has moved to `fitted`
  double read_seconds = 0;
  std::size_t images_read = 0;  // of a data set
};

// The fit of a model that is named.
Result<Made> fit_named(const ModelFormat& model, const FitInput& input, const FitSettings& settings) {
  Result<FitResult> fitted = fitter(model.id).fit(input, settings);
  if (!fitted) return fitted.error();
  return Made{&model, *std::move(fitted), {}, {}, 0, 0};
}

Result<Made> fit_auto(const Arguments& a, const FitInput& input, FitSettings settings) {
  const Result<Target> target = target_of(settings.options);
  if (!target) return target.error();
  settings.options.clear();
  Result<AutomaticFit> found = fit_automatically(input, settings, *target, a.sources.dataset.scratch);
  if (!found) return found.error();
  Made made{found->model, std::move(found->fitted), {}, {}, 0, 0};
  made.automatic = *std::move(found);
  fmt::print(stderr, "{}\n", made.automatic->text);
  return made;
}

// The curve of what was made, against what it was made from.
Result<Done> add_curve(const Arguments& a, const FitInput& input, Made& made) {
  const Result<Reference> reference = Reference::of(input, a.sources.dataset.scratch);
  if (!reference) return reference.error();
  const Result<Bytes> file = pack_file(made.fitted.chunks, {.codec = Codec::raw});  // only to be measured
  if (!file) return file.error();
  const auto settings = measure_settings(*file, *reference, {.slow = true});
  if (!settings) return settings.error();
  Result<QualityCurve> curve = curve_of(*settings, *reference, fitter(made.model->id).keeps_texels);
  if (!curve) return curve.error();
  made.curve = *std::move(curve);
  return Done{};
}

// Reads what the model is fitted to, and fits. model: null for the one that measurement chooses.
Result<Made> fit_inputs(const Arguments& a, const ModelFormat* model, const FitSettings& settings) {
  const auto begin = std::chrono::steady_clock::now();
  Result<Made> made = bad_argument("");
  const auto use = [&](const FitInput& input, std::size_t images_read) -> Result<Done> {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    made = model == nullptr ? fit_auto(a, input, settings) : fit_named(*model, input, settings);
    if (!made) return made.error();
    made->read_seconds = seconds;
    made->images_read = images_read;
    return a.measure ? add_curve(a, input, *made) : Result<Done>(Done{});
  };
  const auto with = [&](const Result<Done>& used) -> Result<Made> {
    if (!used) return used.error();
    return std::move(made);
  };
  const FitSources& s = a.sources;
  if (model == nullptr) return with(with_input(s, a.model, use));
  const Fitter& fit = fitter(model->id);
  const bool images = fit.input == InputKind::images || (fit.input == InputKind::either && !s.has_dataset());
  if (images) {
    if (s.dataset.given()) return bad_argument("--crop, --missing and --scratch are for models of data sets");
    for (const std::string& path : s.inputs) {
      // A picture in an EXR file may look like one; folders and descriptions are no pictures.
      if (file_extension(path) != "exr" && is_dataset(path))
        return bad_argument(fmt::format("'{}' is a data set, model {} takes images", path, a.model));
    }
    const Result<FitInput> input = read_maps(s);
    if (!input) return input.error();
    return with(use(*input, 0));
  }
  if (fit.exchange != nullptr && s.inputs.size() == 1 &&
      file_extension(s.inputs[0]) == fit.exchange->extension) {
    if (s.dataset.given() || !s.dataset.scene_file.empty() || !s.maps.empty() || !s.colour_space.empty() ||
        a.measure) {
      return bad_argument(
          fmt::format("a .{} file is taken as it is, without --crop, --missing, --scratch, --scene, --map, "
                      "--colour-space and --measure",
                      fit.exchange->extension));
    }
    Result<FitResult> imported = fit.exchange->import(s.inputs[0], settings);
    if (!imported) return imported.error();
    return Made{model, *std::move(imported), {}, {}, 0, 0};
  }
  return with(with_dataset(s, a.model, use));
}

int run(Arguments& a) {
  const auto stop = [](const Error& e) { return fail("encode", e); };
  const bool automatic = a.model == kAutomatic;
  const ModelFormat* model = automatic ? nullptr : find_model(a.model);
  if (model == nullptr && !automatic)
    return stop(bad_argument(fmt::format("there is no model '{}', see 'btfc models'", a.model)));
  const Result<std::optional<Scene>> scene = a.sources.dataset.scene();
  if (!scene) return stop(scene.error());
  if (*scene) {
    if (const auto met = apply_target(**scene, model, a.model_options); !met) return stop(met.error());
  }
  if (automatic) {
    if (const auto target = target_of(a.model_options); !target) return stop(target.error());
  } else if (const auto known = check_model_options(*model, fitter(model->id).options, a.model_options);
             !known) {
    return stop(known.error());
  }
  const auto seed = parse_u64(a.seed);
  if (!seed)
    return stop(bad_argument(fmt::format("--seed is '{}', expected a whole number below 2^64", a.seed)));
  const Result<PackOptions> pack = pack_options(a.codec, a.level);
  if (!pack) return stop(pack.error());
  const auto begin = std::chrono::steady_clock::now();
  FitSettings settings;
  settings.options = a.model_options;
  settings.seed = *seed;
  settings.threads = a.sources.dataset.threads;
  settings.reconstruct_missing = a.sources.dataset.reconstructs();
  if (settings.reconstruct_missing && (automatic || !fitter(model->id).reconstructs))
    return stop(bad_argument(fmt::format("--missing model: model {} does not reconstruct images", a.model)));
  settings.progress = progress_line("encoding");
  settings.note = note_line();
  Result<Made> made = fit_inputs(a, model, settings);
  if (!made) return stop(made.error());
  FitResult* const fitted = &made->fitted;
  if (*scene) {
    const Result<Domain> domain = a.sources.dataset.domain(**scene);
    if (!domain) return stop(domain.error());
    fitted->chunks.push_back({{kDomn, 0}, write_domain(*domain)});
  }

  add_meta(*fitted);
  if (made->curve) fitted->chunks.push_back({{kQual, 0}, write_quality(*made->curve)});

  const Result<Bytes> file = pack_file(std::move(fitted->chunks), *pack);
  if (!file) return stop(file.error());
  ByteView view(*file);
  const Result<OpenedFile> check = open_file(memory_source(&view));
  if (!check) return stop(check.error());
  for (const SideImage& side : fitted->side_images) {
    if (const auto wrote = write_image(side.path, side.image); !wrote) return stop(wrote.error());
  }
  if (const auto wrote = write_file(a.output, *file); !wrote) return stop(wrote.error());

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double texels = static_cast<double>(check->head.width) * check->head.height;
  const double formula = static_cast<double>(check->layout.formula_bits) / texels;
  const double on_disk = 8.0 * static_cast<double>(file->size()) / texels;
  std::string text =
      fmt::format("{}: {}x{}, {} bytes, {:.4f} bits per texel by formula, {:.4f} as a file, {:.2f} s",
                  a.output, check->head.width, check->head.height, file->size(), formula, on_disk, seconds);
  Json json = {{"output", a.output},
               {"model", made->model->name},
               {"width", check->head.width},
               {"height", check->head.height},
               {"file_bytes", file->size()},
               {"payload_bits", 8 * check->directory.header.payload_bytes},
               {"formula_bits", check->layout.formula_bits},
               {"bits_per_texel", formula},
               {"bits_per_texel_file", on_disk},
               {"seconds", seconds},
               {"read_seconds", made->read_seconds}};
  if (made->images_read > 0) json["images_read"] = made->images_read;
  const Json sizes = size_json(check->head, check->layout);
  for (const char* rate : {"bits_per_sample", "ratio_u8", "ratio_u16"}) json[rate] = sizes[rate];
  if (check->head.pairs > 1)
    text +=
        fmt::format(", {} pairs, ratio {:.2f} at 8 bit", check->head.pairs, sizes["ratio_u8"].get<double>());
  for (const Parameter& found : fitted->report) {
    text += fmt::format(", {} {}", found.name, found.value);
    json[found.name] = value_of(found);
  }
  if (made->automatic) json["auto"] = made->automatic->reasons;
  if (made->curve) {
    json["quality"] = quality_json(*made->curve);
    text += '\n' + quality_text(*made->curve);
  }
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_encode(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("encode", "encode images or a BTF into a .btfc file");
  verb->add_option("INPUT", a->sources.inputs,
                   "the image (PNG, JPEG, TIFF, EXR, HDR), which becomes the map 'image'; or a data set (see "
                   "convert); for "
                   "model ptm also a .ptm file");
  verb->add_option("--map", a->sources.maps, "a named map, may be repeated")
      ->type_name("NAME=FILE")
      ->take_all();
  verb->add_option("-o,--output", a->output, "the file to write")->required()->type_name("OUT.btfc");
  verb->add_option("--model", a->model,
                   "the model, see 'btfc models'; auto: the one that "
                   "measurement finds best for --psnr, --bytes or --decode-cost")
      ->required()
      ->type_name("ID");
  add_pack_options(*verb, a->codec, a->level);
  verb->add_option("--seed", a->seed, "seed of random choices (default 1)")->type_name("N");
  a->sources.dataset.attach(*verb, true);
  a->sources.dataset.attach_scene(*verb);
  verb->add_option("--colour-space", a->sources.colour_space,
                   "what the maps' values are (default: as the files say)")
      ->type_name("ID");
  verb->add_flag("--measure", a->measure,
                 "measure what the file is worth with fewer levels and gates, and keep the curve in it");
  a->report.attach(*verb);
  for (const ModelFormat& model : models())
    add_model_options(*verb, model, fitter(model.id).options, a->model_options);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
