// btfc compare of two data sets.
#pragma once
#include <string>

#include "encoder/metrics/dataset_metrics.h"
#include "tools/json.h"

namespace btfc {

// JSON as spec/command.md has it, and a table for people.
Json dataset_metrics_json(const DatasetMetrics& metrics);
std::string dataset_metrics_text(const DatasetMetrics& metrics);

// JSON has no infinity and no NaN: null.
Json number_or_null(double v);

}  // namespace btfc
