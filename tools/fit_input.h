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

// The META chunk of what was fitted: how it was made, and by whom.
void add_meta(FitResult& fitted);

// What is done with the input. images_read: of a data set.
using UseInput = std::function<Result<Done>(const FitInput& input, std::size_t images_read)>;

// INPUT becomes the map "image"; --map NAME=FILE adds named ones; of --scene the texels and channels it asks
// for.
Result<FitInput> read_maps(const FitSources& sources);

// Reads the data set of a model and hands it to `use`, on threads of --threads. model: its name, for
// messages.
Result<Done> with_dataset(const FitSources& sources, const std::string& model, const UseInput& use);

// Maps or a data set, whichever the input is.
Result<Done> with_input(const FitSources& sources, const std::string& model, const UseInput& use);

}  // namespace btfc
