// Where a reader's bytes come from: a size and a stateless positioned read.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "format/bytes.h"

namespace btfc {

// read() fills destination with size bytes from offset and returns false where it cannot; it must be
// thread-safe, since chunks may be read concurrently.
struct ByteSource {
  bool (*read)(void* user, std::uint64_t offset, void* destination, std::size_t size) = nullptr;
  void* user = nullptr;
  std::uint64_t size = 0;
};

// A source over memory; the view must outlive the source.
inline ByteSource memory_source(const ByteView* view) {
  ByteSource source;
  source.read = [](void* user, std::uint64_t offset, void* destination, std::size_t size) {
    const ByteView& bytes = *static_cast<const ByteView*>(user);
    if (offset > bytes.size() || size > bytes.size() - offset) return false;
    if (size != 0) std::memcpy(destination, bytes.data() + offset, size);
    return true;
  };
  source.user = const_cast<ByteView*>(view);
  source.size = view->size();
  return source;
}

}  // namespace btfc
