// A .btfc file opened for positioned reads.
#pragma once
#include <string>

#include "format/result.h"
#include "format/source.h"

namespace btfc {

// Movable, closes its file. source() stays valid while the object does not move.
class FileSource {
 public:
  static Result<FileSource> open(const std::string& path);
  FileSource(FileSource&& other) noexcept : file_(other.file_), size_(other.size_) { other.file_ = -1; }
  FileSource& operator=(FileSource&&) = delete;
  ~FileSource();
  ByteSource source() const;

 private:
  FileSource(int file, std::uint64_t size) : file_(file), size_(size) {}
  int file_;
  std::uint64_t size_;
};

// The error, with the file that it is about.
Error placed(const std::string& path, Error error);

}  // namespace btfc
