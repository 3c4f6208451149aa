// The automatic choice of the sample: which window of the input makes the texture most like the input.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "encoder/model_table.h"
#include "encoder/models/patch_synthesis.h"
#include "format/models/patch_payload.h"

namespace btfc {

struct SampleWindow {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

// How far a texture is from the input, each part averaged over the maps, all 0 at best.
struct SampleScore {
  double gradient = 0;  // |ln gradient_kept|
  double spectrum = 0;  // spectrum_distance
  double colour = 0;    // colour_distance
  double seams = 0;     // ln seam_ratio where that is above 1
  double total() const { return gradient + spectrum + colour + seams; }
};

struct SampleChoice {
  SampleWindow window;
  SampleScore score;  // of the texture that was synthesised from the window
  std::size_t windows = 0, syntheses = 0;
};

// Looks at windows of shape.sample_width x shape.sample_height on an even grid over the input, at most 7x7
// (or 49 in a row where the input leaves one direction only): first at each window itself, by the score
// without seams; then at textures of about twice its side, synthesised from the six best windows with the
// shape's patches. The lowest total wins, of equal ones the first. All maps share the window. The shape is
// that of the texture to come and fits into the input. Runs on the calling oneTBB arena; the choice does not
// depend on it.
SampleChoice choose_sample(std::span<const NamedImage> maps, const PatchShape& shape,
                           const SynthesisSettings& settings);

}  // namespace btfc
