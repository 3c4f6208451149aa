// What the models of random fields are fitted to: one image a subspace, less the light that the range map
// stands for.
#pragma once
#include <optional>
#include <vector>

#include "encoder/fields/plane.h"
#include "encoder/model_table.h"
#include "format/models/field_payload.h"

namespace btfc {

struct FieldInput {
  Head head;
  bool wraps = false;
  Directions directions;
  std::vector<std::uint16_t> subspace_of_pair;
  std::vector<std::size_t> medoids;  // the pair of each subspace's image
  // The range map as stored, and the strength of the bump filter.
  std::uint32_t range_width = 0, range_height = 0, range_bits = 0;
  float relief = 0, height_step = 0;
  std::vector<std::uint16_t> range;
  std::vector<std::vector<FieldPlane>> channels;  // of each subspace, values divided by the bump filter's
  std::vector<Parameter> report;
};

Result<FieldInput> field_input(ModelId model, const FitInput& input, const FitSettings& settings);

}  // namespace btfc
