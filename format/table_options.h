// What the models of a BTF's directions share: options of `btfc size`, and what they ask of HEAD.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "format/head.h"
#include "format/model_table.h"
#include "format/options.h"
#include "format/result.h"

namespace btfc {

inline constexpr OptionSpec kTableSizeOptions[] = {
    {"size", "N|WxH", "texels of the tile (required)"},
    {"directions", "N", "as many views as lights, in place of --views and --lights"},
    {"views", "N", "number of views (default 81)"},
    {"lights", "N", "number of lights (default 81)"},
    {"pairs", "N", "number of pairs of a view and a light (default: all)"},
    {"channels", "N", "channels of the one map, 1 to 4 (default 3)"},
    {"bits", "8|16", "bits a sample of the original (default 8)"},
};

// kTableSizeOptions and a model's own.
template <std::size_t N>
constexpr auto with_table_options(const OptionSpec (&own)[N]) {
  std::array<OptionSpec, std::size(kTableSizeOptions) + N> all{};
  std::copy_n(own, N, std::copy_n(kTableSizeOptions, std::size(kTableSizeOptions), all.begin()));
  return all;
}

// The HEAD that these options describe.
Result<Head> table_head(ModelId model, const OptionValues& options);

// Rules V1 and V5: counts fit for tables, not unbounded, no value transform.
Result<Done> check_table_head(const Head& head);

// A count of values of 32 bits, as the survey counts them, and the ratio of the tile's values to it.
PaperCount table_paper(const char* name, const Head& head, std::uint64_t values);

// An error about numbers that somebody typed: without the rule's number.
Error as_usage(Error error);

// A params struct of 4-byte scalars as words.
template <class Params>
std::vector<std::uint32_t> params_words(const Params& params) {
  static_assert(sizeof(Params) % 4 == 0);
  std::vector<std::uint32_t> words(sizeof(Params) / 4);
  std::memcpy(words.data(), &params, sizeof params);
  return words;
}

}  // namespace btfc
