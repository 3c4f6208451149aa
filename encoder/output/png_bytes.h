// A PNG file in memory.
#pragma once
#include "encoder/image.h"
#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

// Of an unorm8 image.
Result<Bytes> png_bytes(const Image& image);

}  // namespace btfc
