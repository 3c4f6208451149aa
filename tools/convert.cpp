// btfc convert: data sets from any format that is read to one that is written, whole or as tiles.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "encoder/input/directory_files.h"
#include "encoder/run_on_threads.h"
#include "encoder/tiling/tile_search.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/dataset_input.h"
#include "tools/dataset_output.h"

namespace btfc {
namespace {

struct Arguments {
  std::string input, output, tile;
  std::uint32_t tiles = 1, sheet = 64, repeats = 1;
  DatasetInput dataset;
  Report report;
};

// OUT-2.exr for the second of several tiles, OUT-2 for a directory.
std::string tile_path(const std::string& path, std::size_t number, std::size_t count) {
  if (count == 1) return path;
  const std::string suffix = '-' + std::to_string(number);
  const std::string kind = file_extension(path);
  if (kind == "png" || kind == "exr") return path.substr(0, path.size() - 4) + suffix + '.' + kind;
  return path + suffix;
}

Result<TileOptions> tile_options(const Arguments& a) {
  TileOptions options;
  options.count = a.tiles;
  if (a.tile == "auto") return options;
  const auto size = split_numbers(a.tile, 'x');
  if (!size || size->size() != 2) {
    return bad_argument(fmt::format("--tile is '{}', expected WxH or auto", a.tile));
  }
  options.size = std::pair((*size)[0], (*size)[1]);
  return options;
}

Result<Done> convert(const Arguments& a) {
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  if (a.input.empty()) return bad_argument("INPUT is missing");
  if (a.tile.empty() && a.tiles > 1) return bad_argument("--tiles is for --tile");
  Result<TileOptions> wanted = TileOptions{};
  if (!a.tile.empty()) wanted = tile_options(a);
  if (!wanted) return wanted.error();

  const Result<DatasetRead> read = a.dataset.read(a.input);
  if (!read) return read.error();
  std::string text = dataset_text(*read);
  Json json = dataset_json(*read);
  json["read_seconds"] = seconds();
  if (a.tile.empty()) {
    if (!a.output.empty()) {
      if (const auto wrote = write_dataset(read->dataset, a.output, {a.sheet, a.repeats}); !wrote)
        return wrote.error();
    }
  } else {
    const Result<TileSet> set = find_tiles(read->dataset, *wanted);
    if (!set) return set.error();
    const TileMap& first = set->tiles[0];
    json["tile"] = {{"x", set->corner.x},     {"y", set->corner.y},      {"width", first.width},
                    {"height", first.height}, {"overlap", set->overlap}, {"seams", Json::array()}};
    text += fmt::format("\ntile {}x{} at {},{}, paths in {} texels", first.width, first.height, set->corner.x,
                        set->corner.y, set->overlap);
    for (std::size_t n = 0; n < set->tiles.size(); ++n) {
      const TileSeams& seams = set->seams[n];
      json["tile"]["seams"].push_back({{"seam_gradient", seams.seams},
                                       {"interior_gradient", seams.interior},
                                       {"seam_ratio", seams.ratio()}});
      text += fmt::format("\n  seam gradient {:.4f}, interior {:.4f}, ratio {:.3f}", seams.seams,
                          seams.interior, seams.ratio());
      if (a.output.empty()) continue;
      const Result<Dataset> tile = cut_tile(read->dataset, set->tiles[n], a.dataset.scratch);
      if (!tile) return tile.error();
      const std::string path = tile_path(a.output, n + 1, set->tiles.size());
      if (const auto wrote = write_dataset(*tile, path, {a.sheet, a.repeats}); !wrote) return wrote.error();
    }
  }
  json["seconds"] = seconds();
  text += fmt::format("\n{:.2f} s", seconds());
  return a.report.write(text, json);
}

int run(const Arguments& a) {
  Result<Done> done = Done{};
  run_on_threads(a.dataset.threads, [&] { done = convert(a); });
  return done ? kExitOk : fail("convert", done.error());
}

}  // namespace

Verb add_convert(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand(
      "convert",
      "read a BTF or a reflectance field, tell what it is, and write it in another form, whole or as tiles");
  verb->add_option(
      "INPUT", a->input,
      "a directory of images named as in UBO2003, UTIA, ATRIUM or SPECTRAL; a UBO2014 .btf; a directory "
      "with a light list, or an RTI .lp; a .json description; a multi-part .exr");
  verb->add_option(
          "-o,--output", a->output,
          "DIR: images named as in UBO2003; OUT.exr: one multi-part OpenEXR file; OUT.png: a contact sheet")
      ->type_name("DIR|OUT.exr|OUT.png");
  verb->add_option(
          "--tile", a->tile,
          "cut out a tile that repeats, along minimum error paths common to all directions; auto: of the "
          "size and place whose seams show least")
      ->type_name("auto|WxH");
  verb->add_option("--tiles", a->tiles,
                   "so many tiles that join each other freely, OUT-1 … OUT-N (default 1)")
      ->check(CLI::Range(1, 256))
      ->type_name("N");
  verb->add_option("--sheet", a->sheet, "of a contact sheet: the most images (default 64)")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
  verb->add_option("--repeats", a->repeats, "of a contact sheet: copies of each image a side (default 1)")
      ->check(CLI::Range(1, 16))
      ->type_name("N");
  a->dataset.attach(*verb);
  a->report.attach(*verb);
  return {verb, [a] {
            a->report.give_back(a->input);
            return run(*a);
          }};
}

}  // namespace btfc
