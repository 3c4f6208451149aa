// btfc copy and models: another packing of the same chunks; the list of models.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "encoder/output/atomic_file.h"
#include "format/container.h"
#include "tools/command.h"
#include "tools/file_source.h"

namespace btfc {
namespace {

struct CopyArguments {
  std::string input, output, codec = "zstd";
  std::optional<int> level;
  std::string align = "16";
  Report report;
};

int copy(const CopyArguments& a) {
  const auto stop = [](const Error& e) { return fail("copy", e); };
  Result<PackOptions> pack = pack_options(a.codec, a.level);
  if (!pack) return stop(pack.error());
  const auto align = parse_u64(a.align);
  if (!align || *align < 16 || *align > 65536 || (*align & (*align - 1)) != 0) {
    return stop(
        bad_argument(fmt::format("--align is '{}', expected a power of two from 16 to 65536", a.align)));
  }
  while ((std::uint64_t{1} << pack->align_log2) < *align) ++pack->align_log2;
  const Result<FileSource> file = FileSource::open(a.input);
  if (!file) return stop(file.error());
  if (const Result<Done> valid = verify_file(file->source()); !valid)
    return stop(placed(a.input, valid.error()));
  const Result<Directory> directory = read_directory(file->source());
  if (!directory) return stop(directory.error());
  Result<std::vector<RawChunk>> chunks = read_all_chunks(file->source(), *directory);
  if (!chunks) return stop(chunks.error());

  const Result<Bytes> packed = pack_file(*std::move(chunks), *pack);
  if (!packed) return stop(packed.error());
  if (const auto wrote = write_file(a.output, *packed); !wrote) return stop(wrote.error());
  const std::string text =
      fmt::format("{}: {} bytes, was {}", a.output, packed->size(), directory->header.file_bytes);
  const Json json = {{"output", a.output},
                     {"file_bytes", packed->size()},
                     {"input_file_bytes", directory->header.file_bytes},
                     {"chunks", directory->header.chunk_count}};
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return kExitOk;
}

int list_models(const Report& report) {
  std::string text;
  Json json = Json::array();
  for (const ModelFormat& model : models()) {
    text +=
        fmt::format("{}{:<8} {} ({})", text.empty() ? "" : "\n", model.name, model.summary, model.spec_page);
    json.push_back({{"id", model.name},
                    {"number", static_cast<std::uint32_t>(model.id)},
                    {"summary", model.summary},
                    {"spec", model.spec_page}});
  }
  if (const auto wrote = report.write(text, json); !wrote) return fail("models", wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_copy(CLI::App& app) {
  auto a = std::make_shared<CopyArguments>();
  CLI::App* verb =
      app.add_subcommand("copy", "same chunks, other packing; unknown ancillary chunks are kept");
  verb->add_option("IN.btfc", a->input, "the file")->required();
  verb->add_option("-o,--output", a->output, "the file to write")->required()->type_name("OUT.btfc");
  add_pack_options(*verb, a->codec, a->level);
  verb->add_option("--align", a->align, "alignment of chunks in bytes, a power of two (default 16)")
      ->type_name("N");
  a->report.attach(*verb);
  return {verb, [a] { return copy(*a); }};
}

Verb add_models(CLI::App& app) {
  auto report = std::make_shared<Report>();
  CLI::App* verb = app.add_subcommand("models", "list the models");
  report->attach(*verb);
  return {verb, [report] { return list_models(*report); }};
}

}  // namespace btfc
