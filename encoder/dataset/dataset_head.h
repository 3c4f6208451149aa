// What a data set says to HEAD and DIRS.
#pragma once
#include "encoder/dataset/dataset.h"
#include "format/directions.h"

namespace btfc {

struct DatasetHead {
  Head head;
  Directions directions;
};

// Channels go into maps of at most four: one map "image", or "image0", "image1" … Refused: more than 16
// channels, and what rule V1 refuses.
Result<DatasetHead> dataset_head(const DatasetInfo& info, ModelId model);

}  // namespace btfc
