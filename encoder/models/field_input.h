// What the models of random fields are fitted to: one image a subspace, less the light that the range map
// stands for.
#pragma once
#include <vector>

#include "encoder/fields/plane.h"
#include "encoder/model_table.h"
#include "format/models/field_payload.h"

namespace btfc {

struct FieldInput {
  Head head;
  bool wraps = false;
  std::uint32_t range_width = 0, range_height = 0, range_bits = 0;  // of the range map, 0: none
  FieldPayload payload;  // directions, subspaces of pairs, range map and its strength
  std::vector<std::vector<FieldPlane>> channels;  // of each subspace, values divided by the bump filter's
  std::vector<Parameter> report;
};

Result<FieldInput> field_input(ModelId model, const FitInput& input, const FitSettings& settings);

}  // namespace btfc
