// A data set to one OpenEXR file of many parts.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "encoder/dataset/dataset.h"
#include "format/result.h"

namespace btfc {

// Layout: spec/interchange.md. One part a pair; half channels, float ones for unorm16; ZIP. Codes, pairs,
// conventions and directions come back as they are; directions without an image are left out. Compresses on
// the threads of the calling oneTBB arena, a few images at a time; the bytes do not depend on them. The file
// appears whole or not at all. Refused: channels without names, or with the same one.
Result<Done> write_btf_exr(const Dataset& dataset, const std::string& path,
                           const std::function<void(std::size_t done, std::size_t total)>& progress = {});

}  // namespace btfc
