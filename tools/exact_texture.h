// A data set as a texture without loss, so that shaders show it as they show a compressed one.
#pragma once
#include "encoder/dataset/dataset.h"
#include "format/head.h"
#include "tools/texture_file.h"

namespace btfc {

struct ExactTexture {
  Head head;
  TexturePtr texture;
};

// A table of all samples, in memory alone: model lpca with a cluster for each texel and no components.
// Samples of 8 bits and halves stay as they are, those of 16 bits become binary32. Refused: sets whose table
// is larger than a chunk may be.
Result<ExactTexture> exact_texture(const Dataset& dataset);

}  // namespace btfc
