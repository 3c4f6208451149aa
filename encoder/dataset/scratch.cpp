// Unnamed files mapped into memory.
#include "encoder/dataset/scratch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace btfc {

Result<Scratch> Scratch::create(std::uint64_t size, const std::string& directory) {
  std::string place = directory;
  if (place.empty()) {
    const char* wanted = std::getenv("TMPDIR");
    place = wanted != nullptr && *wanted != 0 ? wanted : "/var/tmp";
  }
  const auto failed = [&](const char* what, int code) {
    return io_error(fmt::format("could not {} {} bytes of scratch space in '{}': {}", what, size, place,
                                std::strerror(code)));
  };
  if (size == 0 || size > INT64_MAX) return failed("use", EINVAL);
  std::string path = place + "/btfc-scratch-XXXXXX";
  const int file = mkostemp(path.data(), O_CLOEXEC);
  if (file < 0) return failed("make", errno);
  unlink(path.c_str());
  if (const int code = posix_fallocate(file, 0, static_cast<off_t>(size)); code != 0) {
    close(file);
    return failed("reserve", code);
  }
  void* data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  const int code = errno;
  close(file);
  if (data == MAP_FAILED) return failed("map", code);
  return Scratch(static_cast<std::uint8_t*>(data), size);
}

Scratch::Scratch(Scratch&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

Scratch& Scratch::operator=(Scratch&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

Scratch::~Scratch() {
  if (data_ != nullptr) munmap(data_, size_);
}

}  // namespace btfc
