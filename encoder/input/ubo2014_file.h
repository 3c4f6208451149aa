// A file of the University of Bonn's BTF formats, mapped into memory, and a cursor over its fields.
#pragma once
#include <cstdint>
#include <string>

#include "format/bytes.h"
#include "format/checked.h"
#include "format/result.h"

namespace btfc {

// Mapped read-only: matrices larger than memory stay in the file. Reading is thread-safe.
class Ubo2014File {
 public:
  static Result<Ubo2014File> open(const std::string& path);
  Ubo2014File(Ubo2014File&& other) noexcept;
  Ubo2014File& operator=(Ubo2014File&&) = delete;
  ~Ubo2014File();

  const std::string& path() const { return path_; }
  ByteView bytes() const { return bytes_; }

 private:
  Ubo2014File(std::string path, ByteView bytes) : path_(std::move(path)), bytes_(bytes) {}
  std::string path_;
  ByteView bytes_;
};

// Reads little-endian fields one after another. The first fault stays: after it every field reads as 0, so
// that a reader looks at failed() before it trusts a count, and once at its end.
class Ubo2014Cursor {
 public:
  explicit Ubo2014Cursor(const Ubo2014File& file) : file_(file) {}

  std::uint8_t u8(const std::string& what);
  std::uint32_t u32(const std::string& what);
  float f32(const std::string& what);
  // Passes over `size` bytes and returns where they begin; a fault where the file does not hold them.
  std::uint64_t skip(CheckedSize size, const std::string& what);

  // Records a broken rule at the present offset; the message goes on from "'FILE': ".
  void refuse(const std::string& message) { fail(Status::invalid_file, message); }
  void refuse_unsupported(const std::string& message) { fail(Status::unsupported, message); }

  const std::uint8_t* data(std::uint64_t offset) const { return file_.bytes().data() + offset; }
  std::uint64_t at() const { return at_; }
  std::uint64_t left() const { return file_.bytes().size() - at_; }
  bool failed() const { return fault_.status != Status::ok; }
  const Error& fault() const { return fault_; }

 private:
  void fail(Status status, const std::string& message);

  const Ubo2014File& file_;
  std::uint64_t at_ = 0;
  Error fault_;
};

}  // namespace btfc
