// btfc tradeoff: settings of all models against each other: size, error, speed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>

#include "encoder/output/atomic_file.h"
#include "tools/command.h"
#include "tools/fit_input.h"
#include "tools/progress.h"
#include "tools/trade_page.h"

namespace btfc {
namespace {

struct Arguments {
  FitSources sources;
  std::string models, page, keep, device = "auto", seed = "1";
  double minutes = 24;
  Report report;
};

// "pca,lpca", or all that take such an input.
Result<std::vector<ModelId>> chosen_models(const std::string& text, const FitInput& input) {
  std::vector<ModelId> chosen;
  if (text.empty()) {
    for (const ModelFormat& model : models()) {
      if (takes(fitter(model.id), input)) chosen.push_back(model.id);
    }
    return chosen;
  }
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    const ModelFormat* model = find_model(name);
    if (model == nullptr)
      return bad_argument(fmt::format("--models has '{}', see 'btfc models' for what there is", name));
    if (!takes(fitter(model->id), input)) {
      return bad_argument(fmt::format("--models has '{}', which takes {}", name,
                                      input.dataset == nullptr ? "data sets" : "images"));
    }
    chosen.push_back(model->id);
    begin = end + 1;
  }
  return chosen;
}

// The winners' files, each once, with their curves in them.
Result<std::vector<std::string>> keep_files(const std::string& directory, const Trade& trade,
                                            const TradeSummary& summary, const Reference& reference) {
  std::error_code failed;
  std::filesystem::create_directories(directory, failed);
  if (failed) return io_error(fmt::format("could not make '{}': {}", directory, failed.message()));
  std::vector<std::string> kept;
  std::vector<bool> done(trade.files.size());
  for (const auto* list : {&summary.by_bytes, &summary.by_operations}) {
    for (const auto& w : *list) {
      for (const auto& i : {w.texels, w.texture}) {
        if (!i || done[trade.points[*i].file]) continue;
        const TradePoint& p = trade.points[*i];
        done[p.file] = true;
        const Result<Bytes> bytes = with_curve(trade, p.file, reference);
        if (!bytes) return bytes.error();
        const std::string path = fmt::format("{}/{}-{}.btfc", directory, p.model->name, p.file);
        if (const auto wrote = write_file(path, *bytes); !wrote) return wrote.error();
        kept.push_back(path);
      }
    }
  }
  return kept;
}

Result<Done> trade_off(const Arguments& a, std::uint64_t seed, const FitInput& input) {
  const auto begin = std::chrono::steady_clock::now();
  Result<std::vector<ModelId>> chosen = chosen_models(a.models, input);
  if (!chosen) return chosen.error();
  const Result<Reference> reference = Reference::of(input, a.sources.dataset.scratch);
  if (!reference) return reference.error();
  TradeOptions options;
  options.models = *std::move(chosen);
  options.minutes = a.minutes;
  options.seed = seed;
  options.threads = a.sources.dataset.threads;
  options.measure = {
      .rate_seconds = 0.05, .shader = a.device != "cpu", .slow = true, .pictures = !a.page.empty()};
  options.note = note_line();
  const Result<Trade> trade = run_trade(input, *reference, options);
  if (!trade) return trade.error();
  TradeSummary summary = summary_of(*trade);
  summary.input = a.sources.inputs.empty() ? a.sources.maps[0] : a.sources.inputs[0];
  if (input.dataset != nullptr)
    summary.pairs = static_cast<std::uint32_t>(input.dataset->info().pairs.size());
  summary.measured_pairs = reference->measured_pairs();
  summary.looked_at_pairs = reference->looked_at_pairs();
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Json json = trade_json(*trade, summary);
  if (!a.keep.empty()) {
    const Result<std::vector<std::string>> kept = keep_files(a.keep, *trade, summary, *reference);
    if (!kept) return kept.error();
    json["kept"] = *kept;
  }
  if (!a.page.empty()) {
    const Result<std::string> page = trade_page(*trade, summary, reference->picture());
    if (!page) return page.error();
    const ByteView bytes(reinterpret_cast<const std::uint8_t*>(page->data()), page->size());
    if (const auto wrote = write_file(a.page, bytes); !wrote) return wrote.error();
  }
  return a.report.write(trade_text(*trade, summary), json);
}

int run(Arguments& a) {
  const auto seed = parse_u64(a.seed);
  if (!seed)
    return fail("tradeoff",
                bad_argument(fmt::format("--seed is '{}', expected a whole number below 2^64", a.seed)));
  const Result<Done> done = with_input(
      a.sources, "tradeoff", [&](const FitInput& input, std::size_t) { return trade_off(a, *seed, input); });
  return done ? kExitOk : fail("tradeoff", done.error());
}

}  // namespace

Verb add_tradeoff(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand(
      "tradeoff", "fit settings of models to an input, and hold size, error and speed against each other");
  verb->add_option("INPUT", a->sources.inputs, "an image, or a data set (see convert)");
  verb->add_option("--map", a->sources.maps, "a named map, may be repeated; errors are those of the first")
      ->type_name("NAME=FILE")
      ->take_all();
  verb->add_option("--models", a->models, "only these (default: all that take such an input)")
      ->type_name("ID,…");
  verb->add_option("-o,--output", a->page,
                   "also a page with plots and pictures, which needs nothing beside it")
      ->type_name("REPORT.html");
  verb->add_option("--keep", a->keep, "also the files of the best, each with its measured curve")
      ->type_name("DIR");
  verb->add_option("--minutes", a->minutes,
                   "begin no fit after so many minutes (default 24; 0: all settings, whatever they take)")
      ->check(CLI::Range(0.0, 100000.0))
      ->type_name("N");
  verb->add_option("--device", a->device,
                   "cpu: without rates of shaders (default: with, where there is a device)")
      ->check(CLI::IsMember({"auto", "cpu"}))
      ->type_name("cpu|auto");
  verb->add_option("--seed", a->seed, "seed of random choices (default 1)")->type_name("N");
  verb->add_option("--colour-space", a->sources.colour_space, "as of encode")->type_name("ID");
  a->sources.dataset.attach(*verb);
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
