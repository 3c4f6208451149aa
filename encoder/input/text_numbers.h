// Numbers in lines of text files.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/result.h"

namespace btfc {

// A text file of at most 16 MiB, its lines without line ends; a byte order mark is dropped.
Result<std::vector<std::string>> read_lines(const std::string& path);

// The words of a line, between blanks, tabs, commas and semicolons.
std::vector<std::string_view> words_of(std::string_view line);

// A finite number that is the whole word.
std::optional<double> number_of(std::string_view word);

// The rows of numbers of a text, empty lines and lines that begin with #, % or / left out; empty where
// another line holds something else.
std::optional<std::vector<std::vector<double>>> number_rows(const std::vector<std::string>& lines);

}  // namespace btfc
