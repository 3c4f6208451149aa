// Fuzz target: the codec of chunks, META and arrays of numbers, each from bytes and back; and a model's
// options as text, which `size` takes.
#include <algorithm>
#include <cmath>
#include <string>

#include "format/chunk_codec.h"
#include "format/coded_rows.h"
#include "format/meta.h"
#include "format/model_table.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

void codec(Choices& choices, ByteView bytes) {
  const Codec codec = choices.u8() % 8 == 0 ? Codec::raw : Codec::zstd;
  const std::uint64_t raw_bytes = codec == Codec::raw ? bytes.size() : choices.u32() & 0x3fffff;
  const Result<Bytes> raw = decode_chunk(bytes, codec, raw_bytes);
  FUZZ_CHECK(!raw || raw->size() == raw_bytes);
  FUZZ_CHECK(raw || raw.error().rule[0] == 'C');
}

void codec_both_ways(Choices& choices, ByteView bytes) {
  const int level = 1 + static_cast<int>(choices.u8() % 22);
  if (level > 19 && bytes.size() > 512) return;  // slow, and the same code
  const Result<StoredChunk> stored = encode_chunk(bytes, choices.u8() % 4 ? Codec::zstd : Codec::raw, level);
  FUZZ_CHECK(stored);
  FUZZ_CHECK(stored->codec == Codec::raw || stored->stored.size() < bytes.size());
  const Result<Bytes> raw = decode_chunk(stored->stored, stored->codec, bytes.size());
  FUZZ_CHECK(raw && ByteView(*raw).size() == bytes.size());
  FUZZ_CHECK(std::equal(raw->begin(), raw->end(), bytes.begin(), bytes.end()));
  FUZZ_CHECK(content_hash(*raw) == content_hash(bytes));
}

void meta(ByteView bytes) {
  const Result<Meta> read = read_meta(bytes);
  if (!read) return;
  const Bytes written = write_meta(*read);
  FUZZ_CHECK(std::equal(written.begin(), written.end(), bytes.begin(), bytes.end()));
}

void rows(Choices& choices, ByteView bytes) {
  const auto precision = static_cast<Precision>(choices.below(3));
  const std::uint64_t count = 1 + choices.below(16), columns = 1 + choices.below(64);
  const std::uint64_t size = coded_rows_bytes(count, columns, precision).value();
  Bytes raw(bytes.begin(), bytes.end());
  raw.resize(size);
  const Result<CodedRows> read = read_coded_rows(raw, count, columns, precision, "T1", "the array");
  if (!read) return;
  FUZZ_CHECK(write_coded_rows(*read) == raw);
  for (std::uint64_t r = 0; r < count; ++r) {
    for (std::uint64_t c = 0; c < columns; ++c) FUZZ_CHECK(std::isfinite(read->value(r, c)));
  }
}

// Lines of name=value: what is described is a HEAD that reads back, and its layout a sum that agrees.
void options(Choices& choices, ByteView bytes) {
  const ModelFormat& model = models()[choices.below(kModelCount)];
  OptionValues values;
  for (auto at = bytes.begin(); at != bytes.end();) {
    const auto end = std::find(at, bytes.end(), '\n'), middle = std::find(at, end, '=');
    values[std::string(at, middle)] = middle == end ? std::string() : std::string(middle + 1, end);
    at = end == bytes.end() ? end : end + 1;
  }
  const Result<ItemDescription> item = model.describe(values);
  if (!item) {
    FUZZ_CHECK(!item.error().message.empty());
    return;
  }
  FUZZ_CHECK(item->head.model == model.id && read_head(write_head(item->head)));
  const Result<Layout> layout = model.layout(item->head, item->parm);
  if (!layout) {
    FUZZ_CHECK(!layout.error().message.empty());
    return;
  }
  std::uint64_t payload = 0;
  for (const ChunkSpec& chunk : layout->chunks) {
    if (chunk.key.flags & kPayload) payload += chunk.raw_bytes;
  }
  FUZZ_CHECK(layout->formula_bits == 8 * payload);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const std::uint8_t what = choices.u8();
  Choices parameters(choices.take(5));
  const ByteView bytes = choices.take(choices.left());
  if (what % 5 == 0) codec(parameters, bytes);
  if (what % 5 == 1) codec_both_ways(parameters, bytes);
  if (what % 5 == 2) meta(bytes);
  if (what % 5 == 3) rows(parameters, bytes);
  if (what % 5 == 4) options(parameters, bytes);
  return 0;
}
