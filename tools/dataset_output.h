// Writing data sets for the verbs, in the form that a path asks for.
#pragma once
#include <cstdint>
#include <string>

#include "encoder/dataset/dataset.h"
#include "format/result.h"

namespace btfc {

struct SheetOptions {
  std::uint32_t images = 64, repeats = 1;
};

// DIR: images named as in UBO2003; OUT.exr: one multi-part file; OUT.png: a contact sheet.
Result<Done> write_dataset(const Dataset& dataset, const std::string& path, const SheetOptions& sheet);

}  // namespace btfc
