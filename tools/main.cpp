// The btfc command: one verb a file, see command.h.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>

#include "tools/command.h"

namespace {

using namespace btfc;

// Help that could not be printed is a failure like any other.
int printed(int code) { return std::fflush(stdout) == 0 ? code : kExitIo; }

int run(int argc, char** argv) {
  CLI::App app{"btfc: compact textures that are read texel by texel", "btfc"};
  app.set_version_flag("--version", "btfc 0.1.0, format 0.1");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(
      "Exit codes: 0 ok, 1 usage, 2 input/output, 3 invalid file, 4 failed, 5 not supported, 7 difference "
      "found.");
  const std::vector<Verb> verbs = {add_encode(app), add_decode(app),  add_info(app),   add_verify(app),
                                   add_size(app),   add_compare(app), add_synth(app),  add_bench(app),
                                   add_copy(app),   add_convert(app), add_render(app), add_tradeoff(app),
                                   add_scene(app),  add_models(app)};
  std::string topic;
  CLI::App* help = app.add_subcommand("help", "help on a verb");
  help->add_option("VERB", topic, "the verb");

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& e) {
    return printed(app.exit(e));
  } catch (const CLI::CallForAllHelp& e) {
    return printed(app.exit(e));
  } catch (const CLI::CallForVersion& e) {
    return printed(app.exit(e));
  } catch (const CLI::ParseError& e) {
    // CLI11 says only that a verb is missing; the word that is none is more use.
    const bool no_verb = argc > 1 && argv[1][0] != '-' && app.get_subcommands().empty();
    const std::string why =
        no_verb ? fmt::format("there is no verb '{}', see 'btfc help'", argv[1]) : e.what();
    fmt::print(stderr, "btfc: {}\n", why);
    return kExitUsage;
  }
  if (help->parsed()) {
    const CLI::App* about = topic.empty() ? &app : nullptr;
    for (const CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) {
      if (verb->get_name() == topic) about = verb;
    }
    if (about == nullptr) {
      fmt::print(stderr, "btfc help: there is no verb '{}', see 'btfc help'\n", topic);
      return kExitUsage;
    }
    // Not about->help(): that of the whole command would go on to the verb that was parsed, which is this
    // one.
    const std::string name = topic.empty() ? "btfc" : "btfc " + topic;
    fmt::print("{}", app.get_formatter()->make_help(about, name, CLI::AppFormatMode::Normal));
    return printed(kExitOk);
  }
  for (const Verb& verb : verbs) {
    if (verb.app->parsed()) return verb.run();
  }
  return kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "btfc: not enough memory\n");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "btfc: %s\n", e.what());
  }
  return btfc::kExitFailed;
}
