// Shared parts of the verbs.
#include "tools/command.h"

#include <unistd.h>

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

}  // namespace btfc
