// Options of models as text: each model lists its own, the command registers them without knowing the model.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "format/result.h"

namespace btfc {

struct OptionSpec {
  const char* name;     // "wb", given as --wb
  const char* metavar;  // "N", "WxH"; nullptr: a flag without a value
  const char* help;     // with the default
};

// Option name -> text as given; absent means default.
using OptionValues = std::map<std::string, std::string>;

std::optional<std::string> find_option(const OptionValues& values, const std::string& name);

// Each returns nothing where the option is absent and an error that names it where it is malformed or out of
// [least, most].
Result<std::optional<std::uint32_t>> parse_u32(const OptionValues& values, const char* name,
                                               std::uint32_t least, std::uint32_t most);
Result<std::optional<double>> parse_double(const OptionValues& values, const char* name, double least,
                                           double most);

// "WxH", or "N" for NxN where one_number is true.
Result<std::optional<std::pair<std::uint32_t, std::uint32_t>>> parse_pair(
    const OptionValues& values, const char* name, std::uint32_t least, std::uint32_t most, bool one_number);

// The index of the value among choices.
Result<std::optional<std::size_t>> parse_choice(const OptionValues& values, const char* name,
                                                std::span<const char* const> choices);

// Whole numbers separated by single characters: "8,8,32,32" with separator ','. Empty where malformed.
std::optional<std::vector<std::uint32_t>> split_numbers(const std::string& text, char separator);

}  // namespace btfc
