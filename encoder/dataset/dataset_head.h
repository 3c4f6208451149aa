// What a data set says to HEAD and DIRS.
#pragma once
#include "encoder/dataset/dataset.h"
#include "format/directions.h"

namespace btfc {

struct DatasetHead {
  Head head;
  Directions directions;
};

// Size, counts of directions and pairs, and wrapping of a head, as the data set has them.
void describe_tile(const DatasetInfo& info, Head& head);

// Directions and pairs as a file has them: at most 65536 of each side.
Directions directions_of(const DatasetInfo& info);

// Channels go into maps of at most four: one map "image", or "image0", "image1" … Refused: more than 16
// channels, and what rule V1 refuses.
Result<DatasetHead> dataset_head(const DatasetInfo& info, ModelId model);

}  // namespace btfc
