// Data sets from files and directories, whatever their kind.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/dataset/pair_choice.h"
#include "format/result.h"

namespace btfc {

struct Rectangle {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

struct DatasetReadOptions {
  std::optional<Rectangle> crop;      // texels to keep; nothing else is put on scratch space
  std::vector<std::string> channels;  // names or numbers to keep, in the set's order; empty: all
  std::uint32_t scale_log2 = 0;       // squares of 2^scale_log2 texels a side become one (image_reduction.h)
  ChoosePairs choose;                 // which pairs to keep; none: all
  bool skip_missing = false;  // images that the directions ask for and are not there: left out, or an error
  std::string scratch_directory;                                      // empty: as Scratch::create says
  std::function<void(std::size_t done, std::size_t total)> progress;  // from one thread at a time
};

// The texels to keep of a set of width x height: the crop, or all. Refused: a crop that does not lie inside.
Result<Rectangle> kept_texels(const DatasetReadOptions& options, std::uint32_t width, std::uint32_t height,
                              const std::string& path);

// What was read, and what a user should hear of it.
struct DatasetRead {
  Dataset dataset;
  std::size_t images_read = 0;     // of them decoded, not more than the pairs wherever images lie apart
  std::string kind;                // name of the format, as in the list of formats
  std::vector<std::string> notes;  // "412 of 6561 images are missing: …"
};

// Whether a path looks like a data set of some known kind; an image or a .btfc file does not.
bool is_dataset(const std::string& path);

// Streams: holds a few images in memory, and the samples on scratch space. Uses the threads of the calling
// oneTBB arena; the result does not depend on them.
Result<DatasetRead> read_dataset(const std::string& path, const DatasetReadOptions& options);

}  // namespace btfc
