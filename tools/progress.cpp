// Progress on a terminal.
#include "tools/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>

namespace btfc {

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

}  // namespace btfc
