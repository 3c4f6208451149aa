// One file asked in every way: what the table of extremes says about decoding.
#pragma once
#include <string>
#include <vector>

#include "tests/test_support.h"

namespace btfc::test {

// What a query is there for.
inline constexpr const char* kQueryKinds[] = {"measured", "grazing", "below", "nothing", "far"};

struct Query {
  std::size_t kind;  // of kQueryKinds
  btfc_query query;
};

// Of all kinds, the same ones for the same file; no directions for models of images.
std::vector<Query> queries_of(const btfc_texture* texture, std::size_t each);

// Bits of values: of queries one by one, and of whole maps under two pairs of directions (unbounded: one).
struct Answers {
  std::vector<float> values;  // four a query
  std::vector<float> batch;   // the same queries over and over, in one call; not of unbounded textures
  std::vector<float> whole;
  bool operator==(const Answers&) const;  // by bits
};

// Loads and asks with the processor as it is, or with results and operands below the least normal number
// taken for 0. Nothing where the file does not load.
struct Asked {
  Answers answers;
  std::string refusal;  // why there are none
};
Asked ask(const Bytes& file, const std::vector<Query>& queries, bool flush_to_zero = false);

// The same, each query and each band of rows by one of so many threads at once on one texture.
Answers ask_on_threads(const btfc_texture* texture, const std::vector<Query>& queries, std::size_t threads);

}  // namespace btfc::test
