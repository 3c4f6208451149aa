// The kinds of data sets that can be read: one row a kind, tried in this order.
#pragma once
#include <span>
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

struct DatasetFormat {
  const char* name;                             // as in DatasetRead::kind
  bool (*recognises)(const std::string& path);  // from names and first bytes, cheaply; false where unreadable
  Result<DatasetRead> (*read)(const std::string& path, const DatasetReadOptions& options);
};

std::span<const DatasetFormat> dataset_formats();

}  // namespace btfc
