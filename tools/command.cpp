// Shared parts of the verbs.
#include "tools/command.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <memory>

#include "encoder/output/atomic_file.h"

namespace btfc {

int fail(const std::string& verb, const Error& error) {
  const std::string rule = *error.rule != '\0' ? fmt::format(" [{}]", error.rule) : "";
  fmt::print(stderr, "btfc {}: {}{}\n", verb, error.message, rule);
  switch (error.status) {
    case Status::ok:
      return kExitOk;
    case Status::bad_argument:
      return kExitUsage;
    case Status::io:
      return kExitIo;
    case Status::invalid_file:
      return kExitInvalid;
    case Status::out_of_memory:
    case Status::failed:
      return kExitFailed;
    case Status::limit:
    case Status::unsupported:
      return kExitUnsupported;
  }
  return kExitFailed;
}

void Report::attach(CLI::App& app) {
  option_ = app.add_option("--json", path_, "results as JSON, on standard output or to FILE")
                ->expected(0, 1)
                ->type_name("[FILE]");
}

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

std::function<void(std::size_t, std::size_t)> progress_line(const std::string& what) {
  if (isatty(STDERR_FILENO) == 0) return {};
  using Clock = std::chrono::steady_clock;
  auto last = std::make_shared<Clock::time_point>(Clock::now());
  return [what, last](std::size_t done, std::size_t total) {
    const auto now = Clock::now();
    if (done != total && now - *last < std::chrono::milliseconds(100)) return;
    *last = now;
    fmt::print(stderr, "\r{} {:3}%{}", what, total == 0 ? 100 : 100 * done / total,
               done == total ? "\r\033[K" : "");
  };
}

std::function<void(const std::string&)> note_line() {
  if (isatty(STDERR_FILENO) == 0) return {};
  return [](const std::string& state) { fmt::print(stderr, "\r\033[K{}\n", state); };
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
