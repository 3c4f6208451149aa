// btfc encode: images in, one file out.
#include <chrono>

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/model_table.h"
#include "encoder/output/atomic_file.h"
#include "encoder/run_on_threads.h"
#include "format/container.h"
#include "tools/command.h"
#include "tools/dataset_input.h"
#include "tools/size_report.h"

namespace btfc {
namespace {

struct Arguments {
  std::vector<std::string> inputs, maps;
  std::string output, model, codec = "zstd", colour_space;
  std::optional<int> level;
  std::string seed = "1";
  OptionValues model_options;
  DatasetInput dataset;
  Report report;
};

// INPUT becomes the map "image"; --map NAME=FILE adds named ones.
Result<FitInput> read_inputs(const Arguments& a) {
  FitInput input;
  const auto add = [&](const std::string& name, const std::string& path) -> Result<Done> {
    Result<Image> image = read_image(path);
    if (!image) return image.error();
    for (const NamedImage& other : input.maps) {
      if (other.name == name) return bad_argument(fmt::format("two maps are named '{}'", name));
    }
    input.maps.push_back({name, *std::move(image)});
    return Done{};
  };
  if (a.inputs.size() > 1) return bad_argument("more than one INPUT; give the other maps as --map NAME=FILE");
  for (const std::string& path : a.inputs) {
    if (const auto added = add("image", path); !added) return added.error();
  }
  for (const std::string& text : a.maps) {
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
  if (!a.colour_space.empty()) {
    const auto space = colour_space_of(a.colour_space);
    if (!space)
      return bad_argument(fmt::format("--colour-space is '{}', see spec/registry.md", a.colour_space));
    for (NamedImage& map : input.maps) map.image.colour_space = *space;
  }
  return input;
}

// Reads what the model is fitted to, and fits.
Result<FitResult> fit_inputs(const Arguments& a, const Fitter& fit, const FitSettings& settings,
                             double& read_seconds) {
  const auto begin = std::chrono::steady_clock::now();
  const auto read = [&] {
    read_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const bool images = fit.input == InputKind::images ||
                      (fit.input == InputKind::either && !(a.inputs.size() == 1 && is_dataset(a.inputs[0])));
  if (images) {
    if (a.dataset.given()) return bad_argument("--crop, --missing and --scratch are for models of data sets");
    for (const std::string& path : a.inputs) {
      // A picture in an EXR file may look like one; folders and descriptions are no pictures.
      if (file_extension(path) != "exr" && is_dataset(path))
        return bad_argument(fmt::format("'{}' is a data set, model {} takes images", path, a.model));
    }
    const Result<FitInput> input = read_inputs(a);
    if (!input) return input.error();
    read();
    return fit.fit(*input, settings);
  }
  if (fit.exchange != nullptr && a.inputs.size() == 1 &&
      file_extension(a.inputs[0]) == fit.exchange->extension) {
    if (a.dataset.given() || !a.maps.empty() || !a.colour_space.empty()) {
      return bad_argument(
          fmt::format("a .{} file is taken as it is, without --crop, --missing, --scratch, --map "
                      "and --colour-space",
                      fit.exchange->extension));
    }
    return fit.exchange->import(a.inputs[0], settings);
  }
  if (a.inputs.size() != 1 || !a.maps.empty()) {
    return bad_argument(
        fmt::format("model {} takes one data set as INPUT (see 'btfc help convert'), and no --map", a.model));
  }
  if (!a.colour_space.empty()) return bad_argument("--colour-space is for images");
  if (!is_dataset(a.inputs[0])) {
    return bad_argument(
        fmt::format("'{}' is no data set of a known kind, which model {} takes", a.inputs[0], a.model));
  }
  Result<FitResult> fitted = bad_argument("");
  run_on_threads(a.dataset.threads, [&] {
    const Result<DatasetRead> set = a.dataset.read(a.inputs[0]);
    if (!set) {
      fitted = set.error();
      return;
    }
    read();
    FitInput input;
    input.dataset = &set->dataset;
    fitted = fit.fit(input, settings);
  });
  return fitted;
}

int run(Arguments& a) {
  const auto stop = [](const Error& e) { return fail("encode", e); };
  const ModelFormat* model = find_model(a.model);
  if (model == nullptr)
    return stop(bad_argument(fmt::format("there is no model '{}', see 'btfc models'", a.model)));
  const Fitter& fit = fitter(model->id);
  if (const auto known = check_model_options(*model, fit.options, a.model_options); !known)
    return stop(known.error());
  const auto seed = parse_u64(a.seed);
  if (!seed)
    return stop(bad_argument(fmt::format("--seed is '{}', expected a whole number below 2^64", a.seed)));
  const Result<PackOptions> pack = pack_options(a.codec, a.level);
  if (!pack) return stop(pack.error());
  const auto begin = std::chrono::steady_clock::now();
  FitSettings settings;
  settings.options = a.model_options;
  settings.seed = *seed;
  settings.threads = a.dataset.threads;
  settings.reconstruct_missing = a.dataset.reconstructs();
  if (settings.reconstruct_missing && !fit.reconstructs)
    return stop(bad_argument(fmt::format("--missing model: model {} does not reconstruct images", a.model)));
  settings.progress = progress_line("encoding");
  settings.note = note_line();
  double read_seconds = 0;
  Result<FitResult> fitted = fit_inputs(a, fit, settings, read_seconds);
  if (!fitted) return stop(fitted.error());

  fitted->meta["btfc:writer"] = "btfc 0.1.0";
  fitted->chunks.push_back({{kMeta, kSafeToCopy}, write_meta(fitted->meta)});

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
               {"model", a.model},
               {"width", check->head.width},
               {"height", check->head.height},
               {"file_bytes", file->size()},
               {"payload_bits", 8 * check->directory.header.payload_bytes},
               {"formula_bits", check->layout.formula_bits},
               {"bits_per_texel", formula},
               {"bits_per_texel_file", on_disk},
               {"seconds", seconds},
               {"read_seconds", read_seconds}};
  const Json sizes = size_json(check->head, check->layout);
  for (const char* rate : {"bits_per_sample", "ratio_u8", "ratio_u16"}) json[rate] = sizes[rate];
  if (check->head.pairs > 1)
    text +=
        fmt::format(", {} pairs, ratio {:.2f} at 8 bit", check->head.pairs, sizes["ratio_u8"].get<double>());
  for (const Parameter& found : fitted->report) {
    text += fmt::format(", {} {}", found.name, found.value);
    json[found.name] = value_of(found);
  }
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_encode(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("encode", "encode images or a BTF into a .btfc file");
  verb->add_option("INPUT", a->inputs,
                   "the image (PNG, JPEG, TIFF, EXR, HDR), which becomes the map 'image'; or a data set (see "
                   "convert); for "
                   "model ptm also a .ptm file");
  verb->add_option("--map", a->maps, "a named map, may be repeated")->type_name("NAME=FILE")->take_all();
  verb->add_option("-o,--output", a->output, "the file to write")->required()->type_name("OUT.btfc");
  verb->add_option("--model", a->model, "the model, see 'btfc models'")->required()->type_name("ID");
  add_pack_options(*verb, a->codec, a->level);
  verb->add_option("--seed", a->seed, "seed of random choices (default 1)")->type_name("N");
  a->dataset.attach(*verb, true);
  verb->add_option("--colour-space", a->colour_space, "what the maps' values are (default: as the files say)")
      ->type_name("ID");
  a->report.attach(*verb);
  for (const ModelFormat& model : models())
    add_model_options(*verb, model, fitter(model.id).options, a->model_options);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
