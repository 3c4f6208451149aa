// A file's measured curve as JSON and as a table.
#pragma once
#include <string>

#include "format/quality_curve.h"
#include "tools/json.h"

namespace btfc {

// {pairs, points: [...]}; a measure that the curve has not is left out.
Json quality_json(const QualityCurve& curve);
std::string quality_text(const QualityCurve& curve);

}  // namespace btfc
