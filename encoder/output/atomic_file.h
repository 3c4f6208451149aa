// Output files that appear whole or not at all: written beside the target, then renamed over it.
#pragma once
#include <string>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

// A name in the target's directory for the unfinished file, made and removed by this object. commit() flushes
// it to the disk and renames it to the target; without commit the target stays as it was.
class PendingFile {
 public:
  // Creates the unfinished file, empty. Its name ends as the target's does, since image writers go by the
  // extension.
  static Result<PendingFile> create(const std::string& target);
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;
  ~PendingFile();

  const std::string& path() const { return path_; }
  // Writes bytes at an offset; false where the disk does not take them, and then commit() fails too.
  bool write_at(std::uint64_t offset, ByteView bytes);
  Result<Done> commit();

 private:
  PendingFile(std::string target, std::string path, int file)
      : target_(std::move(target)), path_(std::move(path)), file_(file) {}
  std::string target_, path_;
  int file_ = -1;
  int error_ = 0;  // errno of the first write that failed
};

// The whole file at once.
Result<Done> write_file(const std::string& target, ByteView bytes);

Result<Bytes> read_file(const std::string& path);

}  // namespace btfc
