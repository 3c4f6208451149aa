// The Gaussian-Laplacian pyramid of the models of random fields.
#pragma once
#include "encoder/fields/plane.h"

namespace btfc {

// The Gaussian planes, the finest first: the plane itself, then each reduced from the one before.
std::vector<FieldPlane> gaussian_pyramid(const FieldPlane& plane, std::uint32_t levels, bool wraps);

// Paper eqs 3 to 5 with the reduction factor 2 and the generating kernel (1, 4, 6, 4, 1) / 16 of Burt and
// Adelson 1983: levels - 1 band-pass planes, the finest first, then the low-pass one. Beyond the border the
// plane is repeated where it wraps, otherwise mirrored. Expanding is the decoder's (spec/models/car.md
// section 5.4).
std::vector<FieldPlane> laplacian_pyramid(const FieldPlane& plane, std::uint32_t levels, bool wraps);

}  // namespace btfc
