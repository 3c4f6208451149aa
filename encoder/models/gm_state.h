// The state of a fit as bytes, to be read by the same program on the same machine.
#pragma once
#include <cstring>
#include <type_traits>
#include <vector>

#include "format/bytes.h"

namespace btfc {

class StateWriter {
 public:
  template <class... T>
  void put(const T&... values) {
    (add(&values, sizeof values), ...);
    static_assert((std::is_trivially_copyable_v<T> && ...));
  }
  template <class T>
  void put_all(const std::vector<T>& values) {
    put(values.size());
    add(values.data(), values.size() * sizeof(T));
  }
  const Bytes& bytes() const { return bytes_; }

 private:
  void add(const void* from, std::size_t size) {
    const auto* b = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), b, b + size);
  }
  Bytes bytes_;
};

// Reads in the order of writing; complete() is false where bytes ran out or are left.
class StateReader {
 public:
  explicit StateReader(ByteView bytes) : bytes_(bytes) {}
  template <class... T>
  void get(T&... values) {
    (take(&values, sizeof values), ...);
    static_assert((std::is_trivially_copyable_v<T> && ...));
  }
  template <class T>
  void get_all(std::vector<T>& values) {
    std::size_t count = 0;
    get(count);
    if (count > bytes_.size() / sizeof(T)) {
      good_ = false;
      return;
    }
    values.resize(count);
    take(values.data(), count * sizeof(T));
  }
  bool complete() const { return good_ && bytes_.empty(); }

 private:
  void take(void* to, std::size_t size) {
    good_ = good_ && size <= bytes_.size();
    if (!good_) return;
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
  }
  ByteView bytes_;
  bool good_ = true;
};

}  // namespace btfc
