// Scratch space on disk, mapped into memory: data sets larger than memory live here.
#pragma once
#include <cstdint>
#include <string>

#include "format/result.h"

namespace btfc {

// A file without a name, mapped shared: its pages are the kernel's to write out, and count as file memory,
// not as anonymous memory. All of it is reserved on the disk at once, so that a full disk is an error here
// and not a signal later.
class Scratch {
 public:
  // directory empty: $TMPDIR, else /var/tmp, which unlike /tmp is on a disk everywhere.
  static Result<Scratch> create(std::uint64_t size, const std::string& directory);
  Scratch(Scratch&& other) noexcept;
  Scratch& operator=(Scratch&& other) noexcept;
  ~Scratch();

  std::uint8_t* data() const { return data_; }
  std::uint64_t size() const { return size_; }

 private:
  Scratch(std::uint8_t* data, std::uint64_t size) : data_(data), size_(size) {}
  std::uint8_t* data_ = nullptr;
  std::uint64_t size_ = 0;
};

}  // namespace btfc
