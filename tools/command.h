// What the verbs of the command share: exit codes, output of results, and how a verb registers itself.
#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

using Json = nlohmann::ordered_json;

// Exit codes of the command, the same for all verbs.
enum ExitCode {
  kExitOk = 0,
  kExitUsage = 1,
  kExitIo = 2,
  kExitInvalid = 3,
  kExitFailed = 4,
  kExitUnsupported = 5,
  kExitDifferent = 7
};

// Prints "btfc VERB: sentence [rule]" to standard error and returns the exit code that fits.
int fail(const std::string& verb, const Error& error);

// Where a verb's results go: text to standard output, JSON instead of it (--json) or beside it (--json FILE).
class Report {
 public:
  // Adds --json [FILE] to a verb.
  void attach(CLI::App& app);
  bool json_to_stdout() const { return option_ != nullptr && option_->count() > 0 && path_.empty(); }
  // `--json x.btfc` swallows a verb's only input; this hands it back where `input` is empty.
  void give_back(std::string& input);
  // Prints text (a line feed is added) or JSON, as asked.
  Result<Done> write(const std::string& text, const Json& json) const;

 private:
  CLI::Option* option_ = nullptr;
  std::string path_;
};

// A progress line on standard error, on a terminal only.
std::function<void(std::size_t done, std::size_t total)> progress_line(const std::string& what);

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
Verb add_models(CLI::App& app);

}  // namespace btfc
