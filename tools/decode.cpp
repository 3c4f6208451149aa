// btfc decode: a file's maps, or a region of them, as images. Decodes in bands: the texture is never held
// whole.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>

#include "decoder/convert.h"
#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/input/text_numbers.h"
#include "encoder/model_table.h"
#include "encoder/output/atomic_file.h"
#include "encoder/run_on_threads.h"
#include "format/limits.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/dataset_output.h"
#include "tools/domain_report.h"
#include "tools/file_source.h"
#include "tools/texture_dataset.h"
#include "tools/texture_file.h"
#include "tools/vulkan_decoder.h"

namespace btfc {
namespace {

struct Arguments {
  std::string input, output, map, region, view, light, directions, scratch, size, origin, relief;
  std::string device = "cpu";
  bool validation = false;
  std::optional<std::uint32_t> levels, gates, decode_cost;
  std::optional<float> psnr, distance, culling;
  std::optional<float> footprint;
  std::uint32_t period = 0;
  unsigned threads = 0;
  Report report;
  bool window() const { return !size.empty() || !origin.empty(); }
};

// "T,P" in degrees; empty: the normal.
Result<Done> parse_direction(const char* name, const std::string& text, float (&direction)[3]) {
  Direction d;
  if (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const auto theta = number_of(std::string_view(text).substr(0, comma));
    const auto phi = comma < text.size() ? number_of(std::string_view(text).substr(comma + 1)) : std::nullopt;
    if (!theta || !phi || *theta < 0 || *theta > 90) {
      return bad_argument(fmt::format(
          "--{} is '{}', expected T,P: degrees from the normal, 0 to 90, and azimuth", name, text));
    }
    d = direction_from_degrees(*theta, *phi);
  }
  const Vector3 v = unit_vector(d);
  for (std::size_t i = 0; i < 3; ++i) direction[i] = static_cast<float>(v[i]);
  return Done{};
}

struct Region {
  std::int32_t x, y;
  std::uint32_t width, height;
};

Result<Region> region_of(const std::string& text, const btfc_texture* texture) {
  const std::uint32_t width = btfc_texture_width(texture), height = btfc_texture_height(texture);
  if (text.empty()) return Region{0, 0, width, height};
  const auto n = split_numbers(text, ',');
  if (!n || n->size() != 4 || (*n)[2] < 1 || (*n)[3] < 1 || std::uint64_t{(*n)[0]} + (*n)[2] > width ||
      std::uint64_t{(*n)[1]} + (*n)[3] > height) {
    return bad_argument(
        fmt::format("--region is '{}', expected X,Y,W,H inside the texture of {}x{}", text, width, height));
  }
  return Region{static_cast<std::int32_t>((*n)[0]), static_cast<std::int32_t>((*n)[1]), (*n)[2], (*n)[3]};
}

// --size and --origin, of unbounded textures.
Result<Region> window_of(const Arguments& a, const btfc_texture* texture) {
  if (!a.region.empty()) return bad_argument("--region lies inside the texture, without --size and --origin");
  Region region{0, 0, btfc_texture_width(texture), btfc_texture_height(texture)};
  if (!a.size.empty()) {
    const auto n = split_numbers(a.size, 'x');
    if (!n || n->size() != 2 || (*n)[0] < 1 || (*n)[1] < 1 || (*n)[0] > kMaxSide || (*n)[1] > kMaxSide)
      return bad_argument(
          fmt::format("--size is '{}', expected WxH, 1 to {} texels a side", a.size, kMaxSide));
    region.width = (*n)[0];
    region.height = (*n)[1];
  }
  if (!a.origin.empty()) {
    const std::size_t comma = std::min(a.origin.find(','), a.origin.size());
    const auto x = number_of(std::string_view(a.origin).substr(0, comma));
    const auto y =
        comma < a.origin.size() ? number_of(std::string_view(a.origin).substr(comma + 1)) : std::nullopt;
    const auto whole = [](double v, std::uint32_t count) {
      return v == std::floor(v) && v >= INT32_MIN && v + count - 1 <= INT32_MAX;
    };
    if (!x || !y || !whole(*x, region.width) || !whole(*y, region.height)) {
      return bad_argument(fmt::format(
          "--origin is '{}', expected X,Y: texels, with the window within -2^31 to 2^31 - 1", a.origin));
    }
    region.x = static_cast<std::int32_t>(*x);
    region.y = static_cast<std::int32_t>(*y);
  }
  return region;
}

// OUT.png of one map, OUT-NAME.png of several.
std::string output_path(const std::string& output, const char* map, bool several) {
  if (!several) return output;
  const std::size_t dot = output.find_last_of('.');
  if (dot == std::string::npos) return output + '-' + map;
  return output.substr(0, dot) + '-' + map + output.substr(dot);
}

// What --levels, --gates and --culling say, or what the file's curve says of --psnr, --distance and
// --decode-cost.
Result<Done> choose_knobs(const Arguments& a, btfc_selection& selection) {
  const bool chosen = a.levels || a.gates || a.culling, wanted = a.psnr || a.distance || a.decode_cost;
  if (chosen && wanted) {
    return bad_argument(
        "--psnr, --distance and --decode-cost choose what --levels, --gates and --culling say; give the ones "
        "or the "
        "others");
  }
  selection.levels = a.levels ? *a.levels + 1 : 0;
  selection.gates = a.gates.value_or(0);
  selection.culling = a.culling.value_or(0);
  if (!wanted) return Done{};
  btfc_wanted what{};
  what.struct_size = sizeof what;
  what.psnr_db = a.psnr.value_or(0);
  what.distance = a.distance.value_or(0);
  what.operations = a.decode_cost.value_or(0);
  return choose_selection(a.input, what, selection);
}

// Fills `count` rows from row y of the region with samples of a map's own type.
using DecodeRows =
    std::function<Result<Done>(std::uint32_t map, std::uint32_t y, std::uint32_t count, std::uint8_t* codes)>;

DecodeRows rows_by_cpu(const btfc_texture* texture, btfc_scratch* scratch, const btfc_directions& directions,
                       const Region& region) {
  return [=](std::uint32_t map, std::uint32_t y, std::uint32_t count, std::uint8_t* codes) -> Result<Done> {
    btfc_map_info info{};
    btfc_texture_map_info(texture, map, &info);
    const std::size_t row = std::size_t{region.width} * info.channels * bytes_of(info.sample);
    const btfc_result result = btfc_decode_rect(texture, scratch, map, &directions, region.x,
                                                region.y + static_cast<std::int32_t>(y), region.width, count,
                                                info.sample, codes, row, count * row);
    if (result != BTFC_OK) return Error{Status::out_of_memory, btfc_result_name(result), "", 0};
    return Done{};
  };
}

// The shaders' way: bands of blocks. Of an unbounded texture each block is prepared, the smaller the more
// subspaces there are.
class ShaderRows {
 public:
  ShaderRows(const btfc_texture* texture, VulkanDecoder decoder, const btfc_directions& directions,
             const Region& region)
      : texture_(texture), decoder_(std::move(decoder)), directions_(directions), region_(region) {}
  const VulkanDecoder& decoder() const { return decoder_; }

  Result<Done> rows(std::uint32_t map, std::uint32_t y, std::uint32_t count, std::uint8_t* codes) {
    btfc_map_info info{};
    btfc_texture_map_info(texture_, map, &info);
    const std::size_t row = std::size_t{region_.width} * info.channels;
    for (std::uint32_t r = 0; r < count; ++r) {
      if (map != map_ || y + r < first_ || y + r >= end_) {
        if (const auto done = fill(map, y + r, info.channels); !done) return done.error();
      }
      const float* from = band_.data() + (y + r - first_) * row;
      for (std::size_t i = 0; i < row; ++i, codes += bytes_of(info.sample))
        store_value(from[i], info.sample, codes);
    }
    return Done{};
  }

 private:
  static std::int32_t at(std::int32_t origin, std::uint32_t offset) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(origin) + offset);
  }

  Result<Done> prepare(std::uint32_t x, std::uint32_t y) {
    if (btfc_texture_unbounded(texture_) == 0) return Done{};
    constexpr std::uint32_t kLeastBlock = 16;
    for (;;) {
      const Result<Done> done = decoder_.prepare({at(region_.x, x), at(region_.y, y), block_, block_});
      if (done || done.error().status != Status::limit || block_ <= kLeastBlock) return done;
      block_ /= 2;
    }
  }

  // The band of rows from `first` on.
  Result<Done> fill(std::uint32_t map, std::uint32_t first, std::uint32_t channels) {
    if (const auto done = prepare(0, first); !done) return done.error();
    map_ = map;
    first_ = first;
    end_ = std::min(first + block_, region_.height);
    band_.resize(std::size_t{end_ - first_} * region_.width * channels);
    for (std::uint32_t x = 0; x < region_.width; x += block_) {
      const std::uint32_t width = std::min(block_, region_.width - x);
      if (x > 0) {
        if (const auto done = prepare(x, first); !done) return done.error();
      }
      const Result<std::vector<float>> values =
          decoder_.rectangle(ShaderStage::compute, map, directions_, at(region_.x, x), at(region_.y, first),
                             width, end_ - first_);
      if (!values) return values.error();
      for (std::size_t texel = 0; texel < values->size() / 4; ++texel) {
        std::copy_n(&(*values)[4 * texel], channels,
                    &band_[(texel / width * region_.width + x + texel % width) * channels]);
      }
    }
    return Done{};
  }

  const btfc_texture* texture_;
  VulkanDecoder decoder_;
  btfc_directions directions_;
  Region region_;
  std::uint32_t block_ = 512, map_ = UINT32_MAX, first_ = 0, end_ = 0;
  std::vector<float> band_;
};

Result<Done> write_map(const btfc_texture* texture, std::uint32_t map, const DecodeRows& rows,
                       const Region& region, const std::string& path) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  ImageHeader header;
  header.width = region.width;
  header.height = region.height;
  header.channels = info.channels;
  header.type = static_cast<SampleType>(info.sample);
  header.colour_space = colour_space_of(info.colour_space).value_or(ColourSpace::unknown);
  header.alpha = static_cast<Alpha>(info.alpha);
  return write_image_rows(path, header, [&](std::uint32_t y, std::uint32_t count, std::uint8_t* codes) {
    return rows(map, y, count, codes);
  });
}

// All pairs of directions.
int decode_all(const Arguments& a, const btfc_texture* texture) {
  const auto stop = [](const Error& e) { return fail("decode", e); };
  if (!a.map.empty() || !a.region.empty() || !a.view.empty() || !a.light.empty() || a.footprint ||
      a.window() || a.device != "cpu") {
    return stop(bad_argument(
        "--directions all decodes all there is, without --map, --region, --size, --origin, --view, --light, "
        "--footprint, --device"));
  }
  Result<Done> done = Done{};
  Json json;
  run_on_threads(a.threads, [&] {
    const Result<Dataset> dataset = decode_dataset(a.input, texture, std::nullopt, a.scratch);
    done = dataset ? write_dataset(*dataset, a.output, {}) : Result<Done>(dataset.error());
    if (!done) return;
    json = {{"output", a.output},
            {"width", dataset->info().width},
            {"height", dataset->info().height},
            {"pairs", dataset->info().pairs.size()}};
  });
  if (!done) return stop(done.error());
  const auto wrote = a.report.write("", json);
  return wrote ? kExitOk : stop(wrote.error());
}

// The model's parameters in the kind of file that others use for them; nothing where OUT names no such file.
std::optional<int> write_exchanged(const Arguments& a) {
  const auto stop = [](const Error& e) { return fail("decode", e); };
  const std::string extension = file_extension(a.output);
  if (extension.empty()) return std::nullopt;
  const Result<FileSource> file = FileSource::open(a.input);
  if (!file) return stop(file.error());
  const ByteSource source = file->source();
  const Result<OpenedFile> opened = open_file(source);
  if (!opened) return stop(placed(a.input, opened.error()));
  const FileExchange* exchange = fitter(opened->head.model).exchange;
  if (exchange == nullptr || extension != exchange->extension) return std::nullopt;
  if (!a.map.empty() || !a.region.empty() || !a.view.empty() || !a.light.empty() || !a.directions.empty() ||
      a.levels || a.gates || a.culling || a.psnr || a.distance || a.decode_cost || a.footprint ||
      a.window() || a.period != 0 || !a.relief.empty() || a.device != "cpu") {
    return stop(
        bad_argument(fmt::format("a .{} file takes all there is, without --map, --region, --view, "
                                 "--light, --directions, --levels, --gates, --culling, --psnr, --distance, "
                                 "--decode-cost, --footprint, --size, --origin, --periodic, --relief, "
                                 "--device",
                                 extension)));
  }
  const Result<Bytes> bytes = exchange->write(opened->head, opened->parm, chunk_reader(source, *opened));
  if (!bytes) return stop(placed(a.input, bytes.error()));
  if (const auto wrote = write_file(a.output, *bytes); !wrote) return stop(wrote.error());
  const Json json = {{"output", a.output}, {"width", opened->head.width}, {"height", opened->head.height}};
  const auto wrote = a.report.write("", json);
  return wrote ? kExitOk : stop(wrote.error());
}

// Says on standard error what of a query lies outside of what a file states that it was made for.
void note_uncovered(const btfc_texture* texture, const btfc_directions& d) {
  btfc_domain domain{};
  btfc_texture_domain(texture, &domain);
  const std::string outside = uncovered_text(btfc_covers(texture, d.view, d.light, d.footprint));
  if (domain.stated == 0 || outside.empty()) return;
  fmt::print(stderr,
             "btfc: outside of what the file was made for: {}; the nearest covered direction answers\n",
             outside);
}

int run(const Arguments& a) {
  const auto stop = [](const Error& e) { return fail("decode", e); };
  if (a.validation && a.device != "vulkan") return stop(bad_argument("--validation is for --device vulkan"));
  if (const std::optional<int> code = write_exchanged(a)) return *code;
  btfc_selection selection{};
  selection.struct_size = sizeof selection;
  if (const auto ok = choose_knobs(a, selection); !ok) return stop(ok.error());
  selection.period = a.period;
  const std::map<std::string, std::uint32_t> reliefs = {{"", 0},
                                                        {"bump", 0},
                                                        {"none", BTFC_RELIEF_NONE},
                                                        {"shadow", BTFC_RELIEF_SHADOW},
                                                        {"parallax", BTFC_RELIEF_PARALLAX},
                                                        {"both", BTFC_RELIEF_SHADOW | BTFC_RELIEF_PARALLAX}};
  selection.relief = reliefs.at(a.relief);
  const Result<TexturePtr> texture = load_texture(a.input, &selection);
  if (!texture) return stop(texture.error());
  if (!a.directions.empty()) return decode_all(a, texture->get());
  btfc_directions directions{};
  directions.footprint = a.footprint.value_or(1);
  if (const auto parsed = parse_direction("view", a.view, directions.view); !parsed)
    return stop(parsed.error());
  if (const auto parsed = parse_direction("light", a.light, directions.light); !parsed)
    return stop(parsed.error());
  note_uncovered(texture->get(), directions);
  if (a.window() && btfc_texture_unbounded(texture->get()) == 0)
    return stop(
        bad_argument(fmt::format("'{}' is not unbounded: --size and --origin do not apply", a.input)));
  const Result<Region> region =
      a.window() ? window_of(a, texture->get()) : region_of(a.region, texture->get());
  if (!region) return stop(region.error());
  std::uint32_t first = 0, end = btfc_texture_maps(texture->get());
  if (!a.map.empty()) {
    const Result<std::uint32_t> number = map_number(texture->get(), a.map);
    if (!number) return stop(number.error());
    first = *number;
    end = first + 1;
  }
  const std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)> scratch(btfc_scratch_new(texture->get()),
                                                                            btfc_scratch_free);
  std::optional<ShaderRows> shader;
  DecodeRows rows = rows_by_cpu(texture->get(), scratch.get(), directions, *region);
  if (a.device == "vulkan") {
    VulkanOptions options;
    options.validation = a.validation;
    Result<VulkanDecoder> opened = VulkanDecoder::open(texture->get(), options);
    if (!opened) return stop(opened.error());
    shader.emplace(texture->get(), std::move(*opened), directions, *region);
    rows = [&](std::uint32_t map, std::uint32_t y, std::uint32_t count, std::uint8_t* codes) {
      return shader->rows(map, y, count, codes);
    };
  }
  Json files = Json::array();
  for (std::uint32_t m = first; m < end; ++m) {
    btfc_map_info info{};
    btfc_texture_map_info(texture->get(), m, &info);
    const std::string path = output_path(a.output, info.name, end - first > 1);
    if (const auto wrote = write_map(texture->get(), m, rows, *region, path); !wrote)
      return stop(wrote.error());
    files.push_back(
        {{"map", info.name}, {"output", path}, {"width", region->width}, {"height", region->height}});
  }
  Json json = {{"files", files}};
  if (shader) json["device"] = shader->decoder().device_name();
  if (const auto wrote = a.report.write("", json); !wrote) return stop(wrote.error());
  return shader && a.validation ? validation_result("decode", shader->decoder().messages()) : kExitOk;
}

}  // namespace

Verb add_decode(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("decode", "decode a file, or a region of it, to PNG or EXR");
  verb->add_option("IN.btfc", a->input, "the file")->required();
  verb->add_option("-o,--output", a->output,
                   "the image to write; of several maps, OUT-NAME.png each; of model ptm with one view also "
                   "OUT.ptm")
      ->required()
      ->type_name("OUT.png|.exr|.ptm|DIR");
  verb->add_option("--map", a->map, "only this map")->type_name("NAME");
  verb->add_option("--region", a->region, "only these texels")->type_name("X,Y,W,H");
  verb->add_option("--size", a->size,
                   "of an unbounded texture: so many texels (default: the analysed tile's)")
      ->type_name("WxH");
  verb->add_option("--origin", a->origin, "of an unbounded texture: the top left texel (default 0,0)")
      ->type_name("X,Y");
  verb->add_option("--periodic", a->period, "of an unbounded texture: repeat every N texels, without seams")
      ->type_name("N");
  verb->add_option(
          "--relief", a->relief,
          "of a range map: bump filter, none, cast shadows, parallax, or both of these (default bump)")
      ->check(CLI::IsMember({"bump", "none", "shadow", "parallax", "both"}))
      ->type_name("KIND");
  verb->add_option("--view", a->view, "of a BTF: the view in degrees, theta,phi (default 0,0)")
      ->type_name("T,P");
  verb->add_option("--light", a->light, "of a BTF: the light in degrees, theta,phi (default 0,0)")
      ->type_name("T,P");
  verb->add_option("--directions", a->directions,
                   "of a BTF: every measured pair, to a directory named as in UBO2003, OUT.exr with a part a "
                   "pair, or OUT.png as a contact sheet")
      ->check(CLI::IsMember({"all"}))
      ->type_name("all");
  verb->add_option("--footprint", a->footprint,
                   "of model gm: each texel seen through a box of so many texels a side (default 1)")
      ->check(CLI::Range(1.0f, 1048576.0f))
      ->type_name("N");
  verb->add_option("--levels", a->levels, "only so many refinements after the coarsest level (default: all)")
      ->type_name("N");
  verb->add_option("--gates", a->gates,
                   "of model gm: only the K highest gates of a texel (default: as the file has it)")
      ->check(CLI::Range(1, 32))
      ->type_name("K");
  verb->add_option("--culling", a->culling,
                   "of model gm on the CPU: leave out what together weighs so little (default 1e-5)")
      ->check(CLI::Range(1e-7f, 0.1f))
      ->type_name("E");
  verb->add_option("--psnr", a->psnr,
                   "by the file's measured curve (encode --measure): the cheapest setting that has P dB")
      ->check(CLI::Range(1.0f, 200.0f))
      ->type_name("P");
  verb->add_option("--distance", a->distance, "likewise, of models that do not keep texels in place")
      ->check(CLI::Range(1e-6f, 1e6f))
      ->type_name("D");
  verb->add_option("--decode-cost", a->decode_cost,
                   "likewise: the best setting of at most N operations a texel in a shader")
      ->check(CLI::Range(1u, UINT32_MAX))
      ->type_name("N");
  verb->add_option(
          "--device", a->device,
          "cpu, or vulkan: the model's compute shader (default cpu); an unbounded texture's window is "
          "prepared beforehand")
      ->check(CLI::IsMember({"cpu", "vulkan"}))
      ->type_name("cpu|vulkan");
  verb->add_flag("--validation", a->validation,
                 "of --device vulkan: with the Vulkan validation layer; what it says is a failure");
  verb->add_option("--scratch", a->scratch, "of --directions: where samples are kept meanwhile")
      ->type_name("DIR");
  verb->add_option("--threads", a->threads, "of --directions: threads (default: all)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
