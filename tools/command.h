// What the verbs of the command share: output of results, and how a verb registers itself.
// A verb's own file includes CLI11: in every file that needs none of it, it would be most of what compiling
// takes.
#pragma once
#include <fmt/format.h>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/bytes.h"
#include "format/container.h"
#include "format/result.h"
#include "tools/exit_code.h"
#include "tools/json.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace btfc {

// Where a verb's results go: text to standard output, JSON instead of it (--json) or beside it (--json FILE).
class Report {
 public:
  // Adds --json [FILE] to a verb.
  void attach(CLI::App& app);
  bool json_to_stdout() const;
  // `--json x.btfc` swallows a verb's only input; this hands it back where `input` is empty.
  void give_back(std::string& input);
  // Prints text (a line feed is added) or JSON, as asked.
  Result<Done> write(const std::string& text, const Json& json) const;

 private:
  CLI::Option* option_ = nullptr;
  std::string path_;
};

// Registers a model's options with a verb; what is given lands in values. An option that several models share
// is registered once.
void add_model_options(CLI::App& verb, const ModelFormat& model, std::span<const OptionSpec> options,
                       OptionValues& values);

// Refuses an option that another model has and this one has not.
Result<Done> check_model_options(const ModelFormat& model, std::span<const OptionSpec> options,
                                 const OptionValues& values);

// --codec and --level, and what they mean together.
void add_pack_options(CLI::App& verb, std::string& codec, std::optional<int>& level);
Result<PackOptions> pack_options(const std::string& codec, std::optional<int> level);

// Of a run with the Vulkan validation layer: prints what it said, which makes the run a failed one.
int validation_result(const std::string& verb, const std::vector<std::string>& messages);

std::optional<std::uint64_t> parse_u64(const std::string& text);

// A verb: adds its sub-command and, once parsed, runs.
struct Verb {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

Verb add_encode(CLI::App& app);
Verb add_decode(CLI::App& app);
Verb add_info(CLI::App& app);
Verb add_verify(CLI::App& app);
Verb add_size(CLI::App& app);
Verb add_compare(CLI::App& app);
Verb add_synth(CLI::App& app);
Verb add_bench(CLI::App& app);
Verb add_copy(CLI::App& app);
Verb add_convert(CLI::App& app);
Verb add_render(CLI::App& app);
Verb add_tradeoff(CLI::App& app);
Verb add_scene(CLI::App& app);
Verb add_models(CLI::App& app);

}  // namespace btfc
