// What a file was made for, in words and as JSON.
#pragma once
#include <optional>

#include "format/domain.h"
#include "tools/json.h"

namespace btfc {

// As spec/command.md has it; null where the file states none.
Json domain_json(const std::optional<Domain>& domain);

// "the view lies outside …", by kCovers… flags; empty where all is covered.
std::string uncovered_text(std::uint32_t covers);

}  // namespace btfc
