// Options and steps of the verbs that read data sets.
#pragma once
#include <string>

#include "encoder/input/dataset_read.h"
#include "tools/command.h"

namespace btfc {

struct DatasetInput {
  std::string crop, missing = "error", scratch;
  unsigned threads = 0;

  // Adds --crop, --missing, --scratch and --threads to a verb. models: whether --missing may be "model".
  void attach(CLI::App& verb, bool models = false);
  bool reconstructs() const { return missing == "model"; }
  bool given() const { return !crop.empty() || missing != "error" || !scratch.empty(); }
  // Reads, shows progress, and prints the notes to standard error.
  Result<DatasetRead> read(const std::string& path) const;
};

// What there is to say of a data set.
Json dataset_json(const DatasetRead& read);
std::string dataset_text(const DatasetRead& read);

}  // namespace btfc
