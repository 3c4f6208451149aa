// Where the patches of a texture join: the places at which seams would show.
#pragma once
#include "encoder/metrics/texture_statistics.h"
#include "format/loaded_item.h"
#include "format/models/patch_payload.h"

namespace btfc {

// Quilting: two neighbours are a join where they show texels of the sample that are not neighbours in the
// same direction. Patches that continue each other join without a trace and are not counted. Liang: two
// neighbours are a join where one of them lies in an overlap, so that a ratio below 1 tells of blur there.
// Neighbours across the border of a texture that wraps are not looked at.
JoinMask patch_joins(const Head& head, const PatchShape& shape, const PatchRecipe& recipe);

// Of a file: the row of the encoder's table.
Result<JoinMask> patch_file_joins(const LoadedItem& item, ByteView parm);

}  // namespace btfc
