// Normals and albedo of texels from their brightness under many known lights: overdetermined photometric
// stereo.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "encoder/dataset/direction.h"

namespace btfc {

// normal: unit length, x right, y to the image's top, z > 0 along the surface's normal. albedo: brightness of
// the texel turned towards a light, of the unit of the intensities. Where nothing is known the normal is
// (0, 0, 1) and the albedo that of a level texel, by least squares, 0 and more.
struct TexelSurface {
  std::array<float, 3> normal{0, 0, 1};
  float albedo = 0;
  bool known = false;
};

enum class StereoMethod {
  least_squares,  // all lights alike: the reference
  robust,         // shadows and gloss are told from Lambert's law and left out
};

struct StereoOptions {
  StereoMethod method = StereoMethod::robust;
  // Whether intensities are albedo * max(n.l, 0). If not, the cosine of the light over the plane, l_z, was
  // divided out (Quantity::reflectance): they are multiplied by it first, and lights with l_z < 0.02, where
  // nothing is left, are not looked at.
  bool cosine_included = true;
};

// lights: unit vectors away from the surface. intensities[light * texels + texel]: linear, finite, 0 and
// more. Result: one a texel.
//
// least_squares: the b = albedo * n with the least sum of (b.l - I)^2.
//
// robust, for six lights and more: several trimmed fits are made, each without the darkest (shadow) and the
// brightest (gloss) lights of the texel, and the one whose median residual |I - max(b.l, 0)| is the least is
// kept; then rounds of least squares weighted by Tukey's function of the residual over its spread (the median
// residual / 0.6745), of the lights that face the texel. Brighter than predicted is forgiven less than
// darker: gloss fades slowly, shadows end at once. With fewer lights nothing can be told by vote: least
// squares over the lights that are brighter than a tenth of the brightest.
//
// known is false where lights do not determine a normal: fewer than three, or so near a plane through the
// origin or to one direction that the least eigenvalue of the sum of l l^T is below 1e-3 of the largest
// (a narrower cone than 2.6 degrees); where all intensities are 0; where b points away from the viewer.
// A choice of lights that does not determine one is passed over, in the end for all lights. Pure,
// deterministic.
std::vector<TexelSurface> photometric_stereo(std::span<const Vector3> lights,
                                             std::span<const float> intensities, std::size_t texels,
                                             const StereoOptions& options = {});

}  // namespace btfc
