// Reflectance fields that Relight and OpenLIME publish: info.json and planes of fitted coefficients.
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"

namespace btfc {

// A directory with info.json and plane_0.
bool is_relight(const std::string& path);

// The fit is relit at the lights that info.json lists: one view at theta 0, 8-bit sRGB-coded images, no more
// than a fit of low order. With byte b of plane p, c_p = (b / 255 - bias_p) scale_p, and w the weights of the
// light (x, y, z), the forms are
//   ptm, rgb:      colour = sum c_i w_i, three planes a term; w = 1, x, y, x^2, xy, y^2
//   ptm, lrgb:     colour = (planes 0 … 2 as they are) sum c_(3+i) w_i
//   hsh, rgb:      as ptm, w the first 4 or 9 hemispherical harmonics (Gautron et al. 2004)
//   rbf, mrgb:     colour = m + sum c_p B_p; m and B are principal components at the listed lights,
//                  interpolated by normalised Gaussians of width sigma, weights up to 0.001 left out
//   bilinear, mrgb: the same on a grid of resolution^2 octahedral nodes, bilinear between them
// m and B come from "basis" in info.json or from materials.bin: bytes [plane][light][colour], m = b / 255,
// B_p = (b - 127) / range_p. Other forms (sh, mycc) are refused: their published readers do not agree.
Result<DatasetRead> read_relight(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
