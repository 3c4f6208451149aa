// Fuzz target: a file opened through a callback whose reads may fail, described, read chunk by chunk,
// verified.
#include <vector>

#include "tests/fuzz/fuzz_reader.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

void describe(btfc_reader* reader, Choices& choices) {
  btfc_file_info info{};
  FUZZ_CHECK(btfc_reader_info(reader, &info) == BTFC_OK);
  FUZZ_CHECK(info.payload_bits <= 8 * kMostPayloadBytes && info.model != nullptr);
  for (std::uint32_t i = 0; i < info.chunks; ++i) {
    btfc_chunk_info chunk{};
    FUZZ_CHECK(btfc_reader_chunk_info(reader, i, &chunk) == BTFC_OK);
    FUZZ_CHECK(chunk.offset + chunk.stored_bytes <= info.file_bytes);
    if (chunk.raw_bytes > kMostRawBytes || (i >= 16 && choices.u8() != 1)) continue;
    std::vector<std::uint8_t> raw(chunk.raw_bytes);
    btfc_error error{};
    check_error(btfc_reader_read_chunk(reader, i, raw.data(), raw.size(), &error), error);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const FileInput input = file_input(data, size);
  Choices choices(input.choices);
  FuzzSource reads{input.file()};
  const btfc_source source = reads.source();
  const btfc_options options = bounded_options();

  bool small = false;
  btfc_result opened = BTFC_OK;
  {
    btfc_reader* made = nullptr;
    btfc_error error{};
    opened = btfc_reader_open(&source, &options, &made, &error);
    const ReaderPtr reader(made);
    check_error(opened, error);
    FUZZ_CHECK((opened == BTFC_OK) == (made != nullptr));
    small = opened != BTFC_OK || small_enough(made);
    if (made != nullptr && small) describe(made, choices);
  }
  if (small) {
    btfc_error error{};
    const btfc_result verified = btfc_verify(&source, &options, &error);
    check_error(verified, error);
    FUZZ_CHECK(verified != BTFC_OK || opened == BTFC_OK);
    FUZZ_CHECK(verified != BTFC_IO && verified != BTFC_BAD_ARGUMENT);
  }
  // The same with reads that fail from some one on.
  if (small) {
    reads.good_reads = choices.below(24);
    const std::uint32_t allowed = reads.good_reads;
    btfc_error error{};
    const btfc_result verified = btfc_verify(&source, &options, &error);
    check_error(verified, error);
    FUZZ_CHECK(verified != BTFC_OK || allowed > 3);
  }
  FUZZ_CHECK(!reads.outside);
  return 0;
}
