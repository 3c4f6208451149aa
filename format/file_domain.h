// DOMN of a file that is open.
#pragma once
#include <optional>

#include "format/container.h"
#include "format/domain.h"

namespace btfc {

// What DOMN says, one read; nothing where the file has none.
Result<std::optional<Domain>> read_file_domain(const ByteSource& source, const OpenedFile& file);

}  // namespace btfc
