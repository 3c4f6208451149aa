// The numbers of a file or of parameters alone, as `info` and `size` print them.
#pragma once
#include "format/container.h"
#include "tools/json.h"

namespace btfc {

// Everything that follows from HEAD and PARM: design's size accounting, all integers, rates as decimals.
Json size_json(const Head& head, const Layout& layout);

// A parameter as JSON shows it.
Json value_of(const Parameter& parameter);

// size_json as aligned text, one line a key.
std::string text_of(const Json& json);

}  // namespace btfc
