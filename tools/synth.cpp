// btfc synth: test material, textures and BTFs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/output/btf_exr_write.h"
#include "encoder/output/ubo2003_write.h"
#include "encoder/run_on_threads.h"
#include "encoder/synth/btf_synth.h"
#include "encoder/synth/texture_synth.h"
#include "format/options.h"
#include "tools/command.h"
#include "tools/progress.h"

namespace btfc {
namespace {

constexpr std::string_view kBtf = "btf:";

struct SynthArguments {
  std::string kind, output, size, type = "unorm8", seed = "1", scratch;
  int directions = 0;
  unsigned threads = 0;
  Report report;
};

struct Common {
  std::uint32_t width, height;
  std::uint64_t seed;
  SampleType type;
};

Result<Common> common(const SynthArguments& a, const char* default_size, std::uint32_t most) {
  const std::string text = a.size.empty() ? default_size : a.size;
  const auto size = split_numbers(text, 'x');
  if (!size || size->size() != 2 || (*size)[0] < 1 || (*size)[1] < 1 || (*size)[0] > most ||
      (*size)[1] > most) {
    return bad_argument(fmt::format("--size is '{}', expected WxH with 1 to {}", text, most));
  }
  const auto seed = parse_u64(a.seed);
  if (!seed) return bad_argument(fmt::format("--seed is '{}', expected a whole number below 2^64", a.seed));
  return Common{(*size)[0], (*size)[1], *seed,
                a.type == "unorm8"    ? SampleType::unorm8
                : a.type == "unorm16" ? SampleType::unorm16
                                      : SampleType::float16};
}

Result<Json> texture(const SynthArguments& a) {
  if (a.directions != 0) return bad_argument("--directions is for btf:<kind>");
  const Result<Common> c = common(a, "512x512", 65536);
  if (!c) return c.error();
  const Result<Image> image = synthesize_texture(a.kind, {c->width, c->height, c->seed, c->type});
  if (!image) return image.error();
  if (const auto wrote = write_image(a.output, *image); !wrote) return wrote.error();
  return Json{{"output", a.output}, {"kind", a.kind}, {"width", c->width}, {"height", c->height}};
}

// OUT and OUT.exr: OUT-height.exr and OUT-normals.png beside them.
Result<Json> btf(const SynthArguments& a) {
  const Result<Common> c = common(a, "64x64", 2048);
  if (!c) return c.error();
  BtfSynthOptions options;
  options.width = c->width;
  options.height = c->height;
  options.seed = c->seed;
  options.directions = a.directions == 0 ? 81 : a.directions;
  options.type = c->type;
  options.scratch_directory = a.scratch;
  options.progress = progress_line("shading");
  const std::string kind = a.kind.substr(kBtf.size());
  const Result<Dataset> dataset = synthesize_btf(kind, options);
  if (!dataset) return dataset.error();
  const Result<BtfGroundTruth> truth = btf_ground_truth(kind, options);
  if (!truth) return truth.error();
  const bool exr = file_extension(a.output) == "exr";
  std::string stem = exr ? a.output.substr(0, a.output.size() - 4) : a.output;
  while (stem.size() > 1 && stem.back() == '/') stem.pop_back();
  if (exr) {
    if (const auto wrote = write_btf_exr(*dataset, a.output); !wrote) return wrote.error();
  } else {
    if (const auto wrote = write_ubo2003(a.output, *dataset); !wrote) return wrote.error();
  }
  const std::string height = stem + "-height.exr", normals = stem + "-normals.png";
  if (const auto wrote = write_image(height, truth->height); !wrote) return wrote.error();
  if (const auto wrote = write_image(normals, truth->normals); !wrote) return wrote.error();
  return Json{{"output", a.output},          {"kind", a.kind},
              {"width", c->width},           {"height", c->height},
              {"views", options.directions}, {"lights", options.directions},
              {"height_map", height},        {"normal_map", normals}};
}

int run(const SynthArguments& a) {
  Result<Json> json = Json();
  run_on_threads(a.threads, [&] { json = a.kind.starts_with(kBtf) ? btf(a) : texture(a); });
  if (!json) return fail("synth", json.error());
  if (const auto wrote = a.report.write("", *json); !wrote) return fail("synth", wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_synth(CLI::App& app) {
  auto a = std::make_shared<SynthArguments>();
  CLI::App* verb = app.add_subcommand("synth", "make a procedural test texture or BTF");
  std::string kinds;
  for (const TextureKind& kind : texture_kinds()) {
    kinds += fmt::format("{}{} ({})", kinds.empty() ? "" : ", ", kind.name, kind.texture_class);
  }
  for (const BtfKind& kind : btf_kinds()) kinds += fmt::format(", btf:{}", kind.name);
  verb->add_option("KIND", a->kind, kinds)->required();
  verb->add_option("-o,--output", a->output,
                   "the image to write; of btf:<kind> a directory named as UBO2003 or one .exr, with the "
                   "height in texels "
                   "and the normals beside it")
      ->required()
      ->type_name("OUT.png|.exr|DIR");
  verb->add_option("--size", a->size, "texels (default 512x512, of a BTF 64x64)")->type_name("WxH");
  verb->add_option("--seed", a->seed, "seed (default 1)")->type_name("N");
  verb->add_option("--type", a->type, "unorm8, unorm16 (textures only) or float16 (default unorm8)")
      ->check(CLI::IsMember({"unorm8", "unorm16", "float16"}))
      ->type_name("TYPE");
  verb->add_option("--directions", a->directions,
                   "of a BTF: views and lights, 81 as UBO2003 or 151 as UBO2014 (default 81)")
      ->check(CLI::IsMember({81, 151}))
      ->type_name("81|151");
  verb->add_option("--scratch", a->scratch, "of a BTF: where samples are kept meanwhile")->type_name("DIR");
  verb->add_option("--threads", a->threads, "threads (default: all)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
