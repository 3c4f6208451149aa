// The range map of a material: the heights of its tile, from the photographs of the view above it.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/range/photometric_stereo.h"
#include "format/result.h"

namespace btfc {

// Views further off the normal show a relief shifted and foreshortened.
inline constexpr double kMostViewDegrees = 5;

struct RangeMap {
  std::uint32_t width = 0, height = 0;
  std::vector<float> heights;  // rows from the top, in texels of the tile, towards the viewer; mean 0
  double known_share = 0;      // of the tile's texels: those whose normal was found
  std::string note;            // why the map is flat; empty where it is not
};

struct RangeOptions {
  StereoMethod method = StereoMethod::robust;
  // Codes are linear whatever the colour space says: sets of photographs in 8 bits often are, and readers
  // take pictures that state nothing for sRGB.
  bool linear_codes = false;
};

// Photometric stereo (photometric_stereo.h) over all lights of the view nearest the normal that has images,
// the first of several; its normals integrated on the torus (integrate_normals.h), so that the map tiles
// where the photographs do not; means over boxes of the tile for the width x height asked for. Values are the
// linear luminance: those of srgb_rec709_scene are decoded first, others are taken as linear. The weights of
// R, G, B are Rec. 709's; channels with other names weigh alike, and one named A is passed over. For
// Quantity::reflectance the light's cosine is multiplied in.
//
// Materials that throw light back to where it comes from (rough, fuzzy ones) and light bounced within the
// relief fit Lambert's law with flatter slopes: their heights keep the shape, at 0.55 to 0.9 of the true size
// on the synthetic materials.
//
// The map is flat, with a note, where the nearest view is more than kMostViewDegrees off the normal, where
// the values are no quantity of light, and where no texel's normal is known. Refused: a size of 0 or above
// the tile's. Uses the threads of the calling oneTBB arena; the result does not depend on them.
Result<RangeMap> estimate_range_map(const Dataset& dataset, std::uint32_t width, std::uint32_t height,
                                    const RangeOptions& options = {});

// The first half of it: every texel's normal and albedo from the view `view`, in rows from the top. The
// quantity is one of light.
std::vector<TexelSurface> surface_of_view(const Dataset& dataset, std::uint32_t view,
                                          const RangeOptions& options = {});

}  // namespace btfc
