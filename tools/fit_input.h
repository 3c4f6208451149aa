// What the verbs that fit models read: images as maps, or a data set.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "encoder/model_table.h"
#include "tools/dataset_input.h"

namespace btfc {

struct FitSources {
  std::vector<std::string> inputs, maps;  // maps: NAME=FILE
  std::string colour_space;
  DatasetInput dataset;

  // Whether the one input is a data set.
  bool has_dataset() const;
};

// INPUT becomes the map "image"; --map NAME=FILE adds named ones.
Result<FitInput> read_maps(const FitSources& sources);

// Reads the data set of a model and hands it to `use`, on threads of --threads. model: its name, for
// messages.
Result<Done> with_dataset(const FitSources& sources, const std::string& model,
                          const std::function<Result<Done>(const FitInput&)>& use);

// Maps or a data set, whichever the input is.
Result<Done> with_input(const FitSources& sources, const std::string& model,
                        const std::function<Result<Done>(const FitInput&)>& use);

}  // namespace btfc
