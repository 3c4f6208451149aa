// Options and steps of the verbs that read data sets.
#pragma once
#include <optional>
#include <string>

#include "encoder/input/dataset_read.h"
#include "encoder/scene/scene_pairs.h"
#include "tools/json.h"

namespace CLI {
class App;
}

namespace btfc {

struct DatasetInput {
  std::string crop, missing = "error", scratch, scene_file;
  unsigned threads = 0;

  // Adds --crop, --missing, --scratch and --threads to a verb. models: whether --missing may be "model".
  void attach(CLI::App& verb, bool models = false);
  // Adds --scene too.
  void attach_scene(CLI::App& verb);
  // What --scene says; nothing where it is not given.
  Result<std::optional<Scene>> scene() const;
  // Of a file made for the scene, from the texels that --crop or the scene keep.
  Result<Domain> domain(const Scene& scene) const;
  bool reconstructs() const { return missing == "model"; }
  bool given() const { return !crop.empty() || missing != "error" || !scratch.empty(); }
  // What --crop and --scene leave of a data set; scene must outlive it.
  Result<DatasetReadOptions> options(const std::optional<Scene>& scene) const;
  // Reads, of a scene what it asks for, shows progress, and prints the notes to standard error.
  Result<DatasetRead> read(const std::string& path) const;

 private:
  Result<std::optional<Rectangle>> texels(const std::optional<Scene>& scene) const;
};

// What there is to say of a data set.
Json dataset_json(const DatasetRead& read);
std::string dataset_text(const DatasetRead& read);

}  // namespace btfc
