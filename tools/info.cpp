// btfc info, verify and size: what a file holds, whether it keeps the rules, and the formula with no file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "encoder/output/atomic_file.h"
#include "format/container.h"
#include "tools/command.h"
#include "tools/domain_report.h"
#include "tools/file_source.h"
#include "tools/quality_report.h"
#include "tools/size_report.h"
#include "tools/sweep.h"

namespace btfc {
namespace {

struct FileArguments {
  std::string input;
  Report report;
};

struct SizeArguments {
  std::string model;
  std::optional<std::string> sweep, plot;
  OptionValues options;
  Report report;
};

Json chunk_json(const IndexEntry& e) {
  return {{"type", type_name(e.key.type)},
          {"flags", e.key.flags},
          {"level", e.key.level},
          {"part", e.key.part},
          {"tile", e.key.tile},
          {"codec", e.codec == Codec::raw ? "raw" : "zstd"},
          {"offset", e.offset},
          {"stored_bytes", e.stored_bytes},
          {"raw_bytes", e.raw_bytes},
          {"raw_hash", fmt::format("{:016x}", e.raw_hash)}};
}

int info(FileArguments& a) {
  a.report.give_back(a.input);
  const auto stop = [&](const Error& e) { return fail("info", e); };
  if (a.input.empty()) return stop(bad_argument("IN.btfc is missing"));
  const Result<FileSource> file = FileSource::open(a.input);
  if (!file) return stop(file.error());
  const Result<OpenedFile> opened = open_file(file->source());
  if (!opened) return stop(placed(a.input, opened.error()));
  const Result<Meta> meta = read_file_meta(file->source(), opened->directory);
  if (!meta) return stop(placed(a.input, meta.error()));
  const Result<std::optional<Domain>> domain = read_file_domain(file->source(), *opened);
  if (!domain) return stop(placed(a.input, domain.error()));
  const Result<std::optional<QualityCurve>> quality = read_file_quality(file->source(), *opened);
  if (!quality) return stop(placed(a.input, quality.error()));

  const Directory& d = opened->directory;
  Json json = size_json(opened->head, opened->layout);
  std::vector<std::uint64_t> raw;
  std::uint64_t stored = 0;
  Json chunks = Json::array();
  for (const IndexEntry& e : d.entries) {
    raw.push_back(e.raw_bytes);
    stored += e.stored_bytes;
    chunks.push_back(chunk_json(e));
  }
  json["file_bytes"] = d.header.file_bytes;
  json["file_max_bytes"] = file_bytes_of(raw, d.header.align_log2).value_or(0);
  json["header_bytes"] = kHeaderBytes;
  json["index_bytes"] = std::uint64_t{kIndexEntryBytes} * d.entries.size();
  json["padding_bytes"] = padding_bytes(d);
  json["stored_bytes"] = stored;
  json["bits_per_texel_file"] = 8.0 * static_cast<double>(d.header.file_bytes) /
                                (static_cast<double>(opened->head.width) * opened->head.height);
  json["domain"] = domain_json(*domain);
  json["meta"] = Json::object();
  for (const auto& [key, value] : *meta) json["meta"][key] = value;
  json["chunks"] = chunks;
  std::string text = text_of(json);
  if (*quality) {
    json["quality"] = quality_json(**quality);
    text += '\n' + quality_text(**quality);
  }
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return kExitOk;
}

int verify(FileArguments& a) {
  a.report.give_back(a.input);
  const auto stop = [&](const Error& e) { return fail("verify", e); };
  if (a.input.empty()) return stop(bad_argument("IN.btfc is missing"));
  const Result<FileSource> file = FileSource::open(a.input);
  if (!file) return stop(file.error());
  const Result<Done> verified = verify_file(file->source());
  Json json = {{"file", a.input}, {"ok", static_cast<bool>(verified)}};
  json["rule"] = verified ? Json() : Json(verified.error().rule);
  json["offset"] = verified ? Json() : Json(verified.error().offset);
  json["message"] = verified ? Json() : Json(verified.error().message);
  if (const auto wrote = a.report.write(verified ? a.input + ": valid" : "", json); !wrote)
    return stop(wrote.error());
  return verified ? kExitOk : stop(placed(a.input, verified.error()));
}

int swept_size(const SizeArguments& a, const ModelFormat& model) {
  const auto stop = [](const Error& e) { return fail("size", e); };
  const Result<SweepRange> range = parse_sweep(*a.sweep);
  if (!range) return stop(range.error());
  const Result<Sweep> sweep = run_sweep(model, a.options, *range);
  if (!sweep) return stop(sweep.error());
  if (a.plot) {
    const std::string svg = sweep_svg(*sweep);
    const ByteView bytes(reinterpret_cast<const std::uint8_t*>(svg.data()), svg.size());
    if (const auto wrote = write_file(*a.plot, bytes); !wrote) return stop(wrote.error());
  }
  const auto wrote = a.report.write(sweep_text(*sweep), sweep_json(*sweep));
  return wrote ? kExitOk : stop(wrote.error());
}

int size(SizeArguments& a) {
  const auto stop = [&](const Error& e) { return fail("size", e); };
  const ModelFormat* model = find_model(a.model);
  if (model == nullptr)
    return stop(bad_argument(fmt::format("there is no model '{}', see 'btfc models'", a.model)));
  if (const auto known = check_model_options(*model, model->size_options, a.options); !known)
    return stop(known.error());
  if (a.sweep) return swept_size(a, *model);
  if (a.plot) return stop(bad_argument("--plot draws a --sweep, and there is none"));
  const Result<ItemDescription> item = model->describe(a.options);
  if (!item) return stop(item.error());
  const Result<Layout> layout = model->layout(item->head, item->parm);
  if (!layout) return stop(layout.error());
  Json json = size_json(item->head, *layout);
  std::vector<std::uint64_t> raw = {32 + 32 * item->head.maps.size()};
  for (const ChunkSpec& chunk : layout->chunks) raw.push_back(chunk.raw_bytes);
  json["file_max_bytes"] = file_bytes_of(raw, kMinAlignLog2).value_or(0);
  if (const auto wrote = a.report.write(text_of(json), json); !wrote) return stop(wrote.error());
  return kExitOk;
}

Verb add_file_verb(CLI::App& app, const char* name, const char* help, int (*run)(FileArguments&)) {
  auto a = std::make_shared<FileArguments>();
  CLI::App* verb = app.add_subcommand(name, help);
  verb->add_option("IN.btfc", a->input, "the file");
  a->report.attach(*verb);
  return {verb, [a, run] { return run(*a); }};
}

}  // namespace

Verb add_info(CLI::App& app) {
  return add_file_verb(app, "info", "parameters, sizes and rates of a file", info);
}
Verb add_verify(CLI::App& app) {
  return add_file_verb(app, "verify", "check every rule of the spec, checksums, formula == payload", verify);
}

Verb add_size(CLI::App& app) {
  auto a = std::make_shared<SizeArguments>();
  CLI::App* verb = app.add_subcommand("size", "sizes by formula, with no file");
  verb->add_option("--model", a->model, "the model, see 'btfc models'")->required()->type_name("ID");
  verb->add_option("--sweep", a->sweep, "a table over values of one of the model's options")
      ->type_name("NAME=FROM:TO:STEP");
  verb->add_option("--plot", a->plot, "the sweep as a picture")->type_name("OUT.svg");
  a->report.attach(*verb);
  for (const ModelFormat& model : models()) add_model_options(*verb, model, model.size_options, a->options);
  return {verb, [a] { return size(*a); }};
}

}  // namespace btfc
