// Random fields made by hand for the tests of the models car, gmrf and car3d: coefficients that are known,
// and errors that follow from them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/split_mix.h"
#include "format/models/field_payload.h"
#include "tests/test_support.h"

namespace btfc::test {

struct FieldRecipe {
  ModelId model = ModelId::car;
  std::vector<std::uint32_t> channels = {3};  // of each map
  std::uint32_t width = 32, height = 24;
  std::uint32_t rings = 0;  // of views and lights, 15 degrees apart; 0: no directions
  std::uint32_t clusters = 1, levels = 3, order = 4, margin = 12, knots = 0, torus_log2 = 6, seed = 1;
  std::uint32_t range_width = 0, range_height = 0;
  double whole = 0.3;   // sum of |a| of every recursion
  double spread = 0.1;  // of the noise
};

// Several subspaces under directions, two maps, tables.
FieldRecipe rich_recipe(ModelId model);

struct MadeField {
  Head head;
  FieldShape shape;
  FieldPayload payload;
  // Where things lie in a subspace's record.
  std::size_t basis_at(std::size_t subspace) const;
  std::size_t signature_at(std::size_t subspace) const;
  std::size_t factor_at(std::size_t subspace, std::size_t factor) const;
};

// Coefficients of both signs, means 0.3 to 0.7, a rotation as basis, signatures that agree with nothing but
// themselves, tables of a straight line, a level range map. shape.error bounds what margins leave out where
// order is at most 4 (neighbours one texel away).
MadeField make_field(const FieldRecipe& recipe);
Bytes file_of(const MadeField& field);

struct LoadedField {
  LoadedItem item;
  FieldParams p;
  BtfcWords words() const { return {{item.words[0].data(), item.words[1].data(), nullptr, nullptr}}; }
};
LoadedField loaded(const Bytes& file);

// A texture of a part of a file; empty where it is refused.
TexturePtr load_part(const Bytes& file, const btfc_selection& selection, btfc_error* error = nullptr);

using ScratchPtr = std::unique_ptr<btfc_scratch, ScratchFree>;
// Values of queries, four places each; the test fails where one is no finite number.
std::vector<float> answers(const btfc_texture* texture, btfc_scratch* scratch,
                           std::span<const btfc_query> queries);
// A rectangle of map 0 along the normal.
std::vector<float> rectangle(const btfc_texture* texture, btfc_scratch* scratch,
                             const btfc_directions& directions, std::int32_t x, std::int32_t y,
                             std::uint32_t width, std::uint32_t height, std::uint32_t map = 0);

double worst_difference(std::span<const float> a, std::span<const float> b);
double mean_of(std::span<const float> values);

// `count` of the 40 candidates.
std::uint64_t random_mask(SplitMix64& random, std::uint32_t count);

}  // namespace btfc::test
