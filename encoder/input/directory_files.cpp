// Directories through std::filesystem, without exceptions.
#include "encoder/input/directory_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

namespace btfc {
namespace {

namespace fs = std::filesystem;

constexpr fs::directory_options kSkipForbidden = fs::directory_options::skip_permission_denied;

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// The run of digits at the front, taken off; without its leading zeros.
std::string_view take_digits(std::string_view& text) {
  std::size_t end = 0;
  while (end < text.size() && is_digit(text[end])) ++end;
  std::string_view run = text.substr(0, end);
  text.remove_prefix(end);
  while (run.size() > 1 && run[0] == '0') run.remove_prefix(1);
  return run;
}

template <class Iterator>
Result<std::vector<std::string>> list(const std::string& directory) {
  std::vector<std::string> paths;
  std::error_code error;
  for (Iterator at(directory, kSkipForbidden, error), end; !error && at != end; at.increment(error)) {
    std::error_code unknown;
    if (at->is_regular_file(unknown)) paths.push_back(at->path().string());
  }
  if (error) return io_error(fmt::format("could not list '{}': {}", directory, error.message()));
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

Result<std::vector<std::string>> files_of_directory(const std::string& directory, bool recursive) {
  return recursive ? list<fs::recursive_directory_iterator>(directory)
                   : list<fs::directory_iterator>(directory);
}

bool any_file_below(const std::string& directory, std::size_t limit,
                    const std::function<bool(const std::string& path)>& property) {
  std::error_code error, unknown;
  std::size_t seen = 0;
  for (fs::recursive_directory_iterator at(directory, kSkipForbidden, error), end; !error && at != end;
       at.increment(error)) {
    if (++seen > limit) return false;
    if (property(at->path().string()) && at->is_regular_file(unknown)) return true;
  }
  return false;
}

bool is_directory(const std::string& path) {
  std::error_code unknown;
  return fs::is_directory(path, unknown);
}

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }
std::string file_stem(const std::string& path) { return fs::path(path).stem().string(); }
std::string file_extension(const std::string& path) {
  const std::string dotted = fs::path(path).extension().string();
  return lower_case(dotted.empty() ? dotted : dotted.substr(1));
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return out;
}

bool is_texture_file(const std::string& path) {
  constexpr std::array<std::string_view, 5> kExtensions = {"jpg", "jpeg", "png", "exr", "hdr"};
  return std::find(kExtensions.begin(), kExtensions.end(), file_extension(path)) != kExtensions.end();
}

bool is_photograph_file(const std::string& path) {
  const std::string extension = file_extension(path);
  return is_texture_file(path) || extension == "tif" || extension == "tiff";
}

bool natural_less(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a, whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a[0]) && is_digit(b[0])) {
      const std::string_view run_a = take_digits(a), run_b = take_digits(b);
      if (run_a.size() != run_b.size()) return run_a.size() < run_b.size();
      if (run_a != run_b) return run_a < run_b;
      continue;
    }
    if (a[0] != b[0]) return a[0] < b[0];
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  return a.empty() != b.empty() ? a.empty() : whole_a < whole_b;
}

}  // namespace btfc
