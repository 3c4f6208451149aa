// POSIX: mkstemps beside the target, fsync, rename, fsync of the directory.
#include "encoder/output/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace btfc {
namespace {

Error failed(const char* what, const std::string& path) {
  return io_error(fmt::format("could not {} '{}': {}", what, path, std::strerror(errno)));
}

std::string directory_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

// Some file systems cannot sync, a directory above all; the rename is then as safe as they make it.
bool sync_failed(int file) { return fsync(file) != 0 && errno != EINVAL && errno != EROFS; }

}  // namespace

Result<PendingFile> PendingFile::create(const std::string& target) {
  struct stat found {};
  if (stat(target.c_str(), &found) == 0 && !S_ISREG(found.st_mode)) {
    return io_error(fmt::format("could not write '{}': it exists and is not a regular file", target));
  }
  const std::string directory = directory_of(target);
  const std::string name = target.substr(target.find_last_of('/') + 1);
  const std::size_t dot = name.find_last_of('.');
  const std::string extension = dot == std::string::npos ? "" : name.substr(dot);
  std::string path = directory + "/." + name.substr(0, 200) + ".XXXXXX" + extension;
  const int file = mkstemps(path.data(), static_cast<int>(extension.size()));
  if (file < 0) return failed("create a file beside", target);
  // mkstemps gives 0600; an output file has the mode that the user's mask asks for.
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(file, 0666 & ~mask);
  return PendingFile(target, path, file);
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : target_(std::move(other.target_)),
      path_(std::move(other.path_)),
      file_(other.file_),
      error_(other.error_) {
  other.path_.clear();
  other.file_ = -1;
}

PendingFile::~PendingFile() {
  if (file_ >= 0) close(file_);
  if (!path_.empty()) unlink(path_.c_str());
}

bool PendingFile::write_at(std::uint64_t offset, ByteView bytes) {
  for (std::size_t done = 0; done < bytes.size() && error_ == 0;) {
    const std::size_t some = std::min<std::size_t>(bytes.size() - done, 1u << 30);
    const ssize_t wrote = pwrite(file_, bytes.data() + done, some, static_cast<off_t>(offset + done));
    if (wrote < 0 && errno != EINTR) error_ = errno;
    if (wrote > 0) done += static_cast<std::size_t>(wrote);
  }
  return error_ == 0;
}

Result<Done> PendingFile::commit() {
  if (error_ == 0 && sync_failed(file_)) error_ = errno;
  const int closed = close(file_);
  file_ = -1;
  if (error_ == 0 && closed != 0) error_ = errno;
  errno = error_;
  if (error_ != 0) return failed("write", target_);
  if (rename(path_.c_str(), target_.c_str()) != 0) return failed("rename the finished file to", target_);
  path_.clear();
  const int directory = open(directory_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory < 0) return Done{};  // a folder that may be written but not read
  const bool bad = sync_failed(directory);
  close(directory);
  return bad ? Result<Done>(failed("write the folder of", target_)) : Result<Done>(Done{});
}

Result<Done> write_file(const std::string& target, ByteView bytes) {
  Result<PendingFile> pending = PendingFile::create(target);
  if (!pending) return pending.error();
  pending->write_at(0, bytes);
  return pending->commit();
}

Result<Bytes> read_file(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open", path);
  struct stat found {};
  if (fstat(file, &found) != 0 || S_ISDIR(found.st_mode)) {
    if (S_ISDIR(found.st_mode)) errno = EISDIR;
    const Error error = failed("read", path);
    close(file);
    return error;
  }
  Bytes bytes;
  constexpr std::size_t kStep = 1u << 20;
  bytes.reserve(found.st_size > 0 ? static_cast<std::size_t>(found.st_size) + 1 : kStep);
  for (;;) {
    const std::size_t have = bytes.size();
    bytes.resize(std::max(bytes.capacity(), have + kStep));
    const ssize_t got = read(file, bytes.data() + have, bytes.size() - have);
    bytes.resize(have + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const Error error = failed("read", path);
      close(file);
      return error;
    }
    if (got == 0) break;
  }
  close(file);
  return bytes;
}

}  // namespace btfc
