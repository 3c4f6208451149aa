// Mapping a file, and reading its fields within its length.
#include "encoder/input/ubo2014_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace btfc {

Result<Ubo2014File> Ubo2014File::open(const std::string& path) {
  const auto failed = [&](const char* what, int code) {
    return io_error(fmt::format("could not {} '{}': {}", what, path, std::strerror(code)));
  };
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open", errno);
  struct stat found {};
  int code = fstat(file, &found) != 0 ? errno : 0;
  if (code == 0 && S_ISDIR(found.st_mode)) code = EISDIR;
  if (code == 0 && !S_ISREG(found.st_mode)) code = ESPIPE;
  const auto size = static_cast<std::size_t>(found.st_size);
  void* data = nullptr;
  if (code == 0 && size > 0) {
    data = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    if (data == MAP_FAILED) code = errno;
  }
  close(file);
  if (code != 0) return failed("read", code);
  return Ubo2014File(path, ByteView(static_cast<const std::uint8_t*>(data), size));
}

Ubo2014File::Ubo2014File(Ubo2014File&& other) noexcept
    : path_(std::move(other.path_)), bytes_(std::exchange(other.bytes_, {})) {}

Ubo2014File::~Ubo2014File() {
  if (!bytes_.empty()) munmap(const_cast<std::uint8_t*>(bytes_.data()), bytes_.size());
}

void Ubo2014Cursor::fail(Status status, const std::string& message) {
  if (failed()) return;
  fault_ = Error{status, fmt::format("'{}': {}", file_.path(), message), "", at_};
}

std::uint64_t Ubo2014Cursor::skip(CheckedSize size, const std::string& what) {
  if (!failed() && size.saturated() > left()) {
    refuse(fmt::format("the file ends within {}: {} bytes from offset {}, expected {}", what, left(), at_,
                       size.valid() ? std::to_string(size.value()) : "more than 2^64"));
  }
  if (failed()) return 0;
  return std::exchange(at_, at_ + size.value());
}

std::uint8_t Ubo2014Cursor::u8(const std::string& what) {
  const std::uint64_t offset = skip(1, what);
  return failed() ? std::uint8_t{0} : *data(offset);
}

std::uint32_t Ubo2014Cursor::u32(const std::string& what) {
  const std::uint64_t offset = skip(4, what);
  return failed() ? 0 : load_u32(data(offset));
}

float Ubo2014Cursor::f32(const std::string& what) { return std::bit_cast<float>(u32(what)); }

}  // namespace btfc
