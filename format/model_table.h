// The one list of models: what the format layer knows of each (design: the model slot).
#pragma once
#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/chunk.h"
#include "format/head.h"
#include "format/knobs.h"
#include "format/loaded_item.h"
#include "format/options.h"
#include "format/result.h"

namespace btfc {

struct Parameter {
  std::string name, value;
  bool number = true;  // how JSON writes the value
};

// A count as the model's paper prints it, beside ours.
struct PaperCount {
  const char* name;
  std::uint64_t bits;
  std::vector<Parameter> counts = {};  // what else the paper counts: values, ratios
};

// What a texel of the first map costs a shader (spec/tables.md section 6), the search for corners aside.
struct TexelCost {
  std::uint64_t operations = 0;  // of floating point
  std::uint64_t reads = 0;       // words of 32 bits, from buffers

  std::uint64_t bytes() const { return 4 * reads; }
};

// Everything that follows from HEAD and PARM alone.
struct Layout {
  std::vector<ChunkSpec> chunks;   // all critical ones but HEAD, in any order
  std::uint64_t formula_bits = 0;  // the spec page's closed formula, not a sum over payload
  std::uint64_t memory_bits = 0;
  std::vector<std::uint64_t> map_bits;  // of formula_bits, what each map of the head takes for itself
  std::optional<PaperCount> paper;
  std::optional<TexelCost> cost;
  std::optional<TexelCost> prepared_cost;  // where textures can be prepared: of a texel that is
  std::vector<Parameter> parameters;
};

struct ItemDescription {
  Head head;
  Bytes parm;
};

// Returns the raw bytes of a payload chunk, already held against its derived size and its hash.
using ChunkReader = std::function<Result<Bytes>(const ChunkKey&)>;

struct ModelFormat {
  ModelId id;
  const char* name;
  const char* summary;
  const char* spec_page;
  std::span<const std::uint32_t> chunk_types;  // critical types of the model beside HEAD and PARM
  std::span<const OptionSpec> size_options;
  // `btfc size`: options -> what a file with them would say.
  Result<ItemDescription> (*describe)(const OptionValues&);
  // The derived sizes; checks the model's rules about HEAD and PARM.
  Result<Layout> (*layout)(const Head&, ByteView parm);
  // Payload -> words and planes; checks the model's rules about contents. Chunks of a higher level than
  // `levels` are not read, and the item answers without them; models without levels ignore it.
  Result<LoadedItem> (*load)(const Head&, ByteView parm, const ChunkReader&, std::uint32_t levels);
  // Optional: PARM of a file that held no more than a decoder uses with these knobs, for its cost. Null: the
  // knobs that the model has do not change what a texel costs.
  Result<Bytes> (*reduced)(const Head&, ByteView parm, const Knobs&) = nullptr;

  bool knows_type(std::uint32_t type) const {
    return std::find(chunk_types.begin(), chunk_types.end(), type) != chunk_types.end();
  }
};

// How many levels a file has: 1 of models without.
std::uint32_t level_count(const Layout& layout);
// Bytes of payload that a decoder reads of so many levels; 0: of all.
std::uint64_t payload_bytes(const Layout& layout, std::uint32_t levels = 0);
// What a texel costs with these knobs; none of models that do not say.
Result<std::optional<TexelCost>> texel_cost(const Head& head, ByteView parm, const Knobs& knobs);

// All levels, for ModelFormat::load.
inline constexpr std::uint32_t kAllLevels = UINT32_MAX;

// Every layer's table has this many rows, in this order; a missing row does not compile.
inline constexpr std::size_t kModelCount = 10;

std::span<const ModelFormat> models();
const ModelFormat* find_model(ModelId id);
const ModelFormat* find_model(std::string_view name);

}  // namespace btfc
