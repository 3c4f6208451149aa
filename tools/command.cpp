// Shared parts of the verbs.
#include "tools/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>

#include "encoder/output/atomic_file.h"

namespace btfc {

void Report::attach(CLI::App& app) {
  option_ = app.add_option("--json", path_, "results as JSON, on standard output or to FILE")
                ->expected(0, 1)
                ->type_name("[FILE]");
}

bool Report::json_to_stdout() const { return option_ != nullptr && option_->count() > 0 && path_.empty(); }

void Report::give_back(std::string& input) {
  if (input.empty() && !path_.empty()) std::swap(input, path_);
}

Result<Done> Report::write(const std::string& text, const Json& json) const {
  if (json_to_stdout()) {
    fmt::print("{}\n", json.dump(2));
  } else {
    if (!text.empty()) fmt::print("{}\n", text);
    if (!path_.empty()) {
      const std::string dumped = json.dump(2) + "\n";
      return write_file(path_, ByteView(reinterpret_cast<const std::uint8_t*>(dumped.data()), dumped.size()));
    }
  }
  if (std::fflush(stdout) != 0) return io_error("could not write to standard output");
  return Done{};
}

void add_model_options(CLI::App& verb, const ModelFormat& model, std::span<const OptionSpec> options,
                       OptionValues& values) {
  for (const OptionSpec& option : options) {
    const std::string name = option.name, flag = "--" + name;
    if (verb.get_option_no_throw(flag) != nullptr) continue;
    CLI::Option* added = nullptr;
    if (option.metavar == nullptr) {
      added = verb.add_flag_callback(
          flag, [&values, name] { values[name] = ""; }, option.help);
    } else {
      const auto take = [&values, name](const std::string& text) { values[name] = text; };
      added = verb.add_option_function<std::string>(flag, take, option.help)->type_name(option.metavar);
    }
    added->group(fmt::format("Options of models: {}", model.name));
  }
}

Result<Done> check_model_options(const ModelFormat& model, std::span<const OptionSpec> options,
                                 const OptionValues& values) {
  for (const auto& [name, value] : values) {
    const auto is_it = [&name = name](const OptionSpec& o) { return name == o.name; };
    if (std::any_of(options.begin(), options.end(), is_it)) continue;
    return bad_argument(fmt::format("--{} is no option of model '{}'", name, model.name));
  }
  return Done{};
}

void add_pack_options(CLI::App& verb, std::string& codec, std::optional<int>& level) {
  verb.add_option("--codec", codec, "raw or zstd (default zstd, where it is smaller)")
      ->check(CLI::IsMember({"raw", "zstd"}))
      ->type_name("CODEC");
  verb.add_option("--level", level, "zstd level, 1 to 22 (default 19)")
      ->check(CLI::Range(1, 22))
      ->type_name("N");
}

Result<PackOptions> pack_options(const std::string& codec, std::optional<int> level) {
  PackOptions options;
  options.codec = codec == "raw" ? Codec::raw : Codec::zstd;
  if (level && options.codec == Codec::raw)
    return bad_argument("--level is for --codec zstd, raw does not compress");
  options.zstd_level = level.value_or(options.zstd_level);
  return options;
}

int validation_result(const std::string& verb, const std::vector<std::string>& messages) {
  for (const std::string& message : messages) fmt::print(stderr, "btfc {}: validation: {}\n", verb, message);
  return messages.empty() ? kExitOk : kExitFailed;
}

std::optional<std::uint64_t> parse_u64(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace btfc
