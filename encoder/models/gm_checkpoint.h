// The file in which a long fit keeps its state.
#pragma once
#include <string>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

// identity: a hash of what the fit depends on, so that a state meets its own fit alone.
Result<Done> write_checkpoint(const std::string& path, std::uint64_t identity, const Bytes& state);
// The state to go on from; nothing where there is no file. Refused: a file that is not whole, or of another
// fit, and a place where none can be written, before time is spent on the fit.
Result<Bytes> begin_checkpoint(const std::string& path, std::uint64_t identity);

}  // namespace btfc
