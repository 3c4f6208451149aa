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

Result<Done> sync_path(const std::string& path, int flags) {
  const int file = open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) return failed("open", path);
  const int synced = fsync(file);
  const int saved = errno;
  close(file);
  errno = saved;
  // Some file systems cannot sync a directory; the rename is then as safe as they make it.
  if (synced != 0 && errno != EINVAL && errno != EROFS) return failed("write", path);
  return Done{};
}

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
  close(file);
  return PendingFile(target, path);
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : target_(std::move(other.target_)), path_(std::move(other.path_)) {
  other.path_.clear();
}

PendingFile::~PendingFile() {
  if (!path_.empty()) unlink(path_.c_str());
}

Result<Done> PendingFile::commit() {
  if (const auto synced = sync_path(path_, O_RDONLY); !synced) return synced.error();
  if (rename(path_.c_str(), target_.c_str()) != 0) return failed("rename the finished file to", target_);
  path_.clear();
  return sync_path(directory_of(target_), O_RDONLY | O_DIRECTORY);
}

Result<Done> write_file(const std::string& target, ByteView bytes) {
  Result<PendingFile> pending = PendingFile::create(target);
  if (!pending) return pending.error();
  const int file = open(pending->path().c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return failed("open", pending->path());
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote =
        write(file, bytes.data() + done, std::min<std::size_t>(bytes.size() - done, 1u << 30));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) {
      const Error error = failed("write", target);
      close(file);
      return error;
    }
    done += static_cast<std::size_t>(wrote);
  }
  if (close(file) != 0) return failed("write", target);
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
