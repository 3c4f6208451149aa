// What the encoder knows of each model: how to fit it to an input.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"
#include "encoder/image.h"
#include "encoder/metrics/texture_statistics.h"
#include "format/chunk.h"
#include "format/loaded_item.h"
#include "format/meta.h"
#include "format/model_table.h"
#include "format/options.h"
#include "format/result.h"

namespace btfc {

struct NamedImage {
  std::string name;  // map name, spec/btfc.md section 5.1
  Image image;
};

// What a model is fitted to.
enum class InputKind { images, dataset, either };

struct FitInput {
  std::vector<NamedImage> maps;      // InputKind::images, and either without a data set: at least one
  const Dataset* dataset = nullptr;  // InputKind::dataset: not null
};

struct FitSettings {
  OptionValues options;  // the model's own
  std::uint64_t seed = 1;
  unsigned threads = 0;              // 0: as many as the machine has
  bool reconstruct_missing = false;  // the file is to answer for all views under all lights
  // Called now and then from one thread: done of total units of work.
  std::function<void(std::size_t done, std::size_t total)> progress;
  // Likewise, in words: how far a fit that may take long has come.
  std::function<void(const std::string& state)> note;
};

// An image that the user asked for beside the file.
struct SideImage {
  std::string path;
  Image image;
};

struct FitResult {
  std::vector<RawChunk> chunks;  // HEAD and the payload
  Meta meta;                     // how it was made
  std::vector<SideImage> side_images;
  std::vector<Parameter> report;  // what the fit found out, for the user
};

// A kind of file that others use for this model's own parameters: read and written without a fit.
struct FileExchange {
  const char* extension;  // lower case
  Result<FitResult> (*import)(const std::string& path, const FitSettings&);
  Result<Bytes> (*write)(const Head&, ByteView parm, const ChunkReader&);
};

inline constexpr const char* kDefaultsAlone[] = {""};

struct Fitter {
  ModelId id;
  InputKind input;
  std::span<const OptionSpec> options;
  // Deterministic: the same input, options and seed give the same chunks on any number of threads.
  Result<FitResult> (*fit)(const FitInput&, const FitSettings&);
  // Optional: where the pieces join that a file's texture is made of. Null: the model has no pieces.
  Result<JoinMask> (*joins)(const LoadedItem& item, ByteView parm) = nullptr;
  const FileExchange* exchange = nullptr;  // optional
  bool reconstructs = false;               // knows FitSettings::reconstruct_missing
  // Whether a decoded texel stands for the original's at its place: then errors texel by texel say something.
  bool keeps_texels = true;
  // Whether each view is fitted on its own: then some views with all their lights stand for the whole, and
  // not some pairs of all views.
  bool views_apart = false;
  // Settings worth trying against each other, as they are given to `btfc encode`, the most telling first:
  // what `btfc tradeoff` and --model auto fit. What a decoder can choose itself (levels, gates) needs no line
  // of its own: one fit shows all of it. Default: the model's own defaults alone.
  std::span<const char* const> ladder = kDefaultsAlone;
  // The option, a whole number in all lines of the ladder, by which size and quality go on between them and
  // beyond. Default: none.
  const char* dial = nullptr;
};

const Fitter& fitter(ModelId id);

}  // namespace btfc
