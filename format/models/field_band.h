// One level of a random field, ready to be synthesised: neighbourhoods, coefficients, and where its noise
// comes from. And the plain way to do it, which the fast one is held against.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "format/models/field_shape.h"
#include "shaders/models/field.h"

namespace btfc {

struct FieldBand {
  FieldKind kind = FieldKind::car;
  std::uint32_t factors = 1, level = 0, margin = 0;
  std::uint32_t seed = 1, period = 0;             // period in texels of level 0; 0: 2^32
  std::vector<std::vector<FieldOffset>> offsets;  // of each factor; of car3d one for all
  std::vector<std::uint32_t> begins;              // where a factor's numbers begin in a record
  std::uint32_t record = 0;                       // numbers a subspace
  const float* numbers = nullptr;                 // a record a subspace; not owned

  bool coupled() const { return kind == FieldKind::car3d; }
  const std::vector<FieldOffset>& neighbours(std::uint32_t factor) const {
    return offsets[coupled() ? 0 : factor];
  }
};

// numbers: clusters x shape.level_numbers(level), not owned.
FieldBand field_band(const FieldShape& shape, std::uint32_t level, const float* numbers);

// Texels of a level; (x, y) is any, in unwrapped coordinates.
struct FieldWindow {
  std::int64_t x = 0, y = 0;
  std::uint32_t width = 0, height = 0;
  std::size_t texels() const { return std::size_t{width} * height; }
};

// Places of a level's lattice along an axis, wrapped.
std::vector<std::uint32_t> field_places(std::int64_t first, std::size_t count, std::uint32_t level,
                                        std::uint32_t period);

// The recursion with its warm-up margin, zero outside: out[factor * texels + y * width + x]. In the order of
// spec/models/car.md section 5.2, products rounded before they are added; Real is float or double.
template <class Real>
void field_synthesise_plain(const FieldBand& band, std::uint32_t subspace, const FieldWindow& window,
                            Real* out);

}  // namespace btfc
