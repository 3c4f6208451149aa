// The inputs at the ends of what a model may be given, one after another: what the table of extremes is made
// of.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tests/btf_support.h"

namespace btfc::test {

// What must come of an input.
enum class Required {
  decodes,       // a valid file, whose values a decoder in doubles gives too
  comes_back,    // that, and every measured value within `most` of the original
  mean_is_kept,  // that, and the mean over the texture within `most` of the original's
  refused        // no file, and a sentence that says why
};

struct Extreme {
  std::string name, model;
  Required required = Required::decodes;
  double most = 0;  // of the largest original value
  OptionValues options;
  std::vector<NamedImage> maps;    // of models of images,
  std::optional<Dataset> dataset;  // and of BTFs
};

// All of one model, in the order of the table.
std::vector<Extreme> extremes_of(const std::string& model);

// Nothing extreme: what builds are compared by.
Extreme ordinary_input(const std::string& model);

// A file whose parameters were fitted, or made by hand, and then changed to what no fit gives.
struct MadeFile {
  std::string name, model;
  Bytes file;
};
std::vector<MadeFile> made_files_of(const std::string& model);

}  // namespace btfc::test
