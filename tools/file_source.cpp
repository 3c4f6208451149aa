// pread with short reads and interruptions handled.
#include "tools/file_source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace btfc {

Result<FileSource> FileSource::open(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return io_error(fmt::format("could not open '{}': {}", path, std::strerror(errno)));
  struct stat found {};
  if (fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) {
    close(file);
    return io_error(fmt::format("could not open '{}': it is not a regular file", path));
  }
  return FileSource(file, static_cast<std::uint64_t>(found.st_size));
}

FileSource::~FileSource() {
  if (file_ >= 0) close(file_);
}

ByteSource FileSource::source() const {
  ByteSource source;
  source.size = size_;
  source.user = const_cast<FileSource*>(this);
  source.read = [](void* user, std::uint64_t offset, void* destination, std::size_t size) {
    const int file = static_cast<const FileSource*>(user)->file_;
    for (std::size_t done = 0; done < size;) {
      const ssize_t got =
          pread(file, static_cast<char*>(destination) + done, size - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      done += static_cast<std::size_t>(got);
    }
    return true;
  };
  return source;
}

Error placed(const std::string& path, Error error) {
  error.message = fmt::format("'{}': {}", path, error.message);
  return error;
}

}  // namespace btfc
