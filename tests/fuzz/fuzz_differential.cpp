// Fuzz target: the library and the reference reader, which was written from the spec alone, about the same
// file: accepted by both, or refused by both as invalid or as unsupported.
#include <errno.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "tests/fuzz/fuzz_reader.h"

namespace {

using namespace btfc;
using namespace btfc::fuzz;

// The reference reader, started once.
class Reference {
 public:
  Reference() {
    int to[2], from[2];
    FUZZ_CHECK(pipe(to) == 0 && pipe(from) == 0);
    child_ = fork();
    FUZZ_CHECK(child_ >= 0);
    if (child_ == 0) {
      dup2(to[0], 0);
      dup2(from[1], 1);
      for (const int fd : {to[0], to[1], from[0], from[1]}) close(fd);
      execlp("/usr/bin/python3", "python3", BTFC_REFERENCE, nullptr);
      _exit(127);
    }
    close(to[0]);
    close(from[1]);
    to_ = to[1];
    from_ = fdopen(from[0], "r");
    // Without it nothing would be compared, and nothing could fail.
    FUZZ_CHECK(line() == "ready");
  }
  ~Reference() {
    close(to_);
    fclose(from_);
    waitpid(child_, nullptr, 0);
  }

  std::string verdict(ByteView file) {
    std::uint8_t size[4];
    store_u32(size, static_cast<std::uint32_t>(file.size()));
    send({size, 4});
    send(file);
    return line();
  }

 private:
  void send(ByteView bytes) {
    while (!bytes.empty()) {
      const ssize_t wrote = write(to_, bytes.data(), bytes.size());
      if (wrote < 0 && errno == EINTR) continue;  // libFuzzer's clock interrupts what waits
      FUZZ_CHECK(wrote > 0);
      bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    }
  }
  std::string line() {
    char text[256] = "";
    while (fgets(text, sizeof text, from_) == nullptr) {
      if (std::ferror(from_) == 0 || errno != EINTR) return "nothing";
      std::clearerr(from_);
    }
    return std::string(text).substr(0, std::strcspn(text, "\n"));
  }

  pid_t child_ = 0;
  int to_ = -1;
  FILE* from_ = nullptr;
};

std::string verdict_of(const btfc_error& error) {
  if (error.result == BTFC_OK) return "ok";
  return std::string(error.result == BTFC_UNSUPPORTED ? "unsupported " : "invalid ") + error.rule;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Reference reference;
  const FileInput input = file_input(data, size);
  FuzzSource reads{input.file()};
  const btfc_source source = reads.source();
  const btfc_options options = bounded_options();
  btfc_error error{};
  btfc_reader* made = nullptr;
  btfc_reader_open(&source, &options, &made, &error);
  const ReaderPtr reader(made);
  // What the library refuses for its bounds the reference would read.
  if (error.result == BTFC_LIMIT || (made != nullptr && !small_enough(made))) return 0;
  btfc_verify(&source, &options, &error);
  if (error.result == BTFC_LIMIT) return 0;
  const std::string ours = verdict_of(error), theirs = reference.verdict(input.file());
  // The rule that is named may be another where a file breaks more than one.
  if (ours.substr(0, ours.find(' ')) != theirs.substr(0, theirs.find(' '))) {
    std::fprintf(stderr, "the library says '%s' (%s), the reference '%s'\n", ours.c_str(), error.message,
                 theirs.c_str());
    std::abort();
  }
  return 0;
}
