// Procedural stand-ins for measured BTFs: tiles of cloth, leather, plaster and metal under pairs of
// directions.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "encoder/dataset/dataset.h"
#include "encoder/image.h"
#include "format/result.h"

namespace btfc {

struct BtfKind {
  const char* name;
  const char* summary;
};
std::span<const BtfKind> btf_kinds();

// The largest tile, in texels: beyond it the height field and its maps would fill the memory.
inline constexpr std::uint64_t kMaxSynthTexels = std::uint64_t{1} << 22;

struct BtfSynthOptions {
  std::uint32_t width = 64, height = 64;  // texels; features keep their size, a larger tile has more of them
  std::uint64_t seed = 1;                 // another sample of the same material
  int directions = 81;                    // of views and of lights: 81 (UBO2003's) or 151 (UBO2014's)
  SampleType type = SampleType::unorm8;   // or float16
  std::string scratch_directory;          // empty: as Scratch::create says
  std::function<void(std::size_t done, std::size_t total)> progress;  // from one thread at a time
};

// The full product of views and lights, rectified on the plane z = 0, the relief's mean height. Values are
// pi f_r cos(theta_light) with shadows and one diffuse bounce, the reflectance of a lamp that gives a white
// Lambertian plane cos(theta_light). Modelled: parallax and masking by the relief, cast shadows with a
// penumbra, a rough diffuse and an anisotropic microfacet term, fuzz on cloth. unorm8: RGB in
// srgb_rec709_scene, clipped at 1; float16: RGB in lin_rec709_scene with highlights above 1. The tile wraps.
//
// Uses the threads of the calling oneTBB arena. Same kind and options give the same codes on any number of
// threads and any machine with IEEE 754 arithmetic. bad_argument: an unknown kind (the message lists the
// kinds), a side of 0, more than kMaxSynthTexels, another type or number of directions.
Result<Dataset> synthesize_btf(std::string_view kind, const BtfSynthOptions& options);

// What the images were made from.
struct BtfGroundTruth {
  Image height;   // one channel, float16: texels above the plane z = 0
  Image normals;  // three channels, unorm16: n * 0.5 + 0.5, x right, y up, z out; of unit length
};

// The mean height and mean slope over each texel. type, directions, scratch_directory and progress are not
// looked at.
Result<BtfGroundTruth> btf_ground_truth(std::string_view kind, const BtfSynthOptions& options);

}  // namespace btfc
