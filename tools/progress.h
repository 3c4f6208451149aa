// What a long run says of itself on standard error, on a terminal only.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

namespace btfc {

// A line with the share that is done.
std::function<void(std::size_t done, std::size_t total)> progress_line(const std::string& what);
// Lines in words.
std::function<void(const std::string& state)> note_line();

}  // namespace btfc
