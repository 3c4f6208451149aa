// META: sorted key = value text that never changes what a decoder returns (spec/btfc.md section 5.3).
#pragma once
#include <map>
#include <string>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

using Meta = std::map<std::string, std::string>;

// Control characters in values become blanks, so that every Meta has a valid form.
Bytes write_meta(const Meta& meta);

// Rule M1.
Result<Meta> read_meta(ByteView raw);

}  // namespace btfc
