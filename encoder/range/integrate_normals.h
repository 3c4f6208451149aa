// Normals -> heights of a tile that repeats.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "encoder/range/photometric_stereo.h"

namespace btfc {

// Slopes beyond it are errors of the normals at edges and in shadow, more than walls of 76 degrees.
inline constexpr double kMostSlope = 4;

// surface: width * height texels, rows from the top. Heights in texels, z towards the viewer, their mean 0:
// of all periodic surfaces h the one whose slopes are the nearest to the normals' in the sum of squares
// (Frankot and Chellappa 1988; the Poisson equation on a torus). With u to the right and v down the rows,
//   dh/du = -nx / nz = p,   dh/dv = ny / nz = q (y of normals goes up),
//   H = -i (w_u P + w_v Q) / (w_u^2 + w_v^2),   w = 2 pi k / n, -n/2 < k <= n/2.
// Each of p and q is clamped to +-kMostSlope and less its mean: a tile that repeats has no slope on the
// whole. Texels that are not known take the mean slope of the others.
//
// The derivative is that of the band-limited surface, i w: a texel's normal is about the mean over the
// texel's square, and the mean slope belongs to the mean height by just that factor, whereas differences of
// neighbours would double the fine waves (central) or shift by half a texel (forward). Waves of two texels
// have slope 0 at all texels in their own direction, which says nothing of their height: what that slope
// gives is imaginary and dropped, but the denominator counts it, so that noise is not raised. Any size;
// deterministic.
std::vector<float> integrate_normals(std::span<const TexelSurface> surface, std::uint32_t width,
                                     std::uint32_t height);

}  // namespace btfc
