// Ways to damage files: hashes made right again, pieces taken apart and put together. Of format/ alone.
#pragma once
#include <vector>

#include "format/container.h"

namespace btfc::test {

ByteSource source_of(const ByteView& bytes);
Result<OpenedFile> open_bytes(const Bytes& file);
Result<Done> verify_bytes(const Bytes& file);

// Makes every hash of a damaged file right again, so that the damage reaches the code behind the hashes.
// Chunks that do not decompress keep their hash. Offsets and sizes are used as they stand, where they lie
// inside the file.
void repair_hashes(Bytes& file);

// Recomputes offsets, file_bytes, payload_bytes and all hashes from edited chunks and entries.
struct Parts {
  Header header;
  std::vector<IndexEntry> entries;
  std::vector<Bytes> stored;
};
Parts take_apart(const Bytes& file);
// Lays the parts out canonically, as they are: entries keep their fields but offset, stored_bytes and
// raw_hash of raw chunks.
Bytes put_together(const Parts& parts);

}  // namespace btfc::test
