// btfc decode: a file's maps, or a region of them, as images. Decodes in bands: the texture is never held
// whole.
#include "encoder/image_file.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/texture_file.h"

namespace btfc {
namespace {

struct Arguments {
  std::string input, output, map, region;
  Report report;
};

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

// OUT.png of one map, OUT-NAME.png of several.
std::string output_path(const std::string& output, const char* map, bool several) {
  if (!several) return output;
  const std::size_t dot = output.find_last_of('.');
  if (dot == std::string::npos) return output + '-' + map;
  return output.substr(0, dot) + '-' + map + output.substr(dot);
}

Result<Done> write_map(const btfc_texture* texture, std::uint32_t map, const Region& region,
                       const std::string& path) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  ImageHeader header;
  header.width = region.width;
  header.height = region.height;
  header.channels = info.channels;
  header.type = static_cast<SampleType>(info.sample);
  header.colour_space = colour_space_of(info.colour_space).value_or(ColourSpace::unknown);
  header.alpha = static_cast<Alpha>(info.alpha);
  const std::size_t row = std::size_t{region.width} * info.channels * (info.sample == BTFC_UNORM8 ? 1 : 2);
  return write_image_rows(
      path, header, [&](std::uint32_t y, std::uint32_t count, std::uint8_t* codes) -> Result<Done> {
        const btfc_result result =
            btfc_decode_rect(texture, nullptr, map, region.x, region.y + static_cast<std::int32_t>(y),
                             region.width, count, info.sample, codes, row, count * row);
        if (result != BTFC_OK) return Error{Status::out_of_memory, btfc_result_name(result), "", 0};
        return Done{};
      });
}

int run(const Arguments& a) {
  const auto stop = [](const Error& e) { return fail("decode", e); };
  const Result<TexturePtr> texture = load_texture(a.input);
  if (!texture) return stop(texture.error());
  const Result<Region> region = region_of(a.region, texture->get());
  if (!region) return stop(region.error());
  std::uint32_t first = 0, end = btfc_texture_maps(texture->get());
  if (!a.map.empty()) {
    const Result<std::uint32_t> number = map_number(texture->get(), a.map);
    if (!number) return stop(number.error());
    first = *number;
    end = first + 1;
  }
  Json files = Json::array();
  for (std::uint32_t m = first; m < end; ++m) {
    btfc_map_info info{};
    btfc_texture_map_info(texture->get(), m, &info);
    const std::string path = output_path(a.output, info.name, end - first > 1);
    if (const auto wrote = write_map(texture->get(), m, *region, path); !wrote) return stop(wrote.error());
    files.push_back(
        {{"map", info.name}, {"output", path}, {"width", region->width}, {"height", region->height}});
  }
  if (const auto wrote = a.report.write("", {{"files", files}}); !wrote) return stop(wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_decode(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("decode", "decode a file, or a region of it, to PNG or EXR");
  verb->add_option("IN.btfc", a->input, "the file")->required();
  verb->add_option("-o,--output", a->output, "the image to write; of several maps, OUT-NAME.png each")
      ->required()
      ->type_name("OUT.png|.exr");
  verb->add_option("--map", a->map, "only this map")->type_name("NAME");
  verb->add_option("--region", a->region, "only these texels")->type_name("X,Y,W,H");
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
